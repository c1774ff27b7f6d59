// Does one task and is ended by the page. The glue of the program stands before it.

function tellProgress(stage, done, of) {
  postMessage({ stage, done, of });
}

const taken = (answer) => ({
  files: answer.files.map(({ name, bytes }) => ({ name, bytes })),
  figures: JSON.parse(answer.figures),
});

function giveEarly(answer) {
  postMessage({ early: taken(answer) });
}

onmessage = ({ data: { module, task, parameters } }) => {
  try {
    wasm_bindgen.initSync({ module });
    const answer = wasm_bindgen[task](...parameters);
    postMessage({ answer: typeof answer === 'string' ? answer : taken(answer) });
  } catch (error) {
    // A refusal is a sentence; everything else is a program that was stopped, for want of memory as a rule.
    const failed = typeof error === 'string' ? error : `the program was stopped (${error.message}); the browser may be short of memory, so close other pages or use the command sombrero`;
    postMessage({ failed });
  }
};
