// The page: forms, frames, progress, files to save. All that computes is in the worker.

'use strict';

/** Bytes of the largest file that is read. */
const LARGEST = Number(document.documentElement.dataset.largest);
/** Stages in words that say something to whoever has not read the paper. */
const WORDS = {
  weld: 'Joining vertices', repair: 'Repairing the mesh', conversion: 'Coarsening the mesh', basis: 'Finding where a mark is not seen',
  insert: 'Moving vertices', 'read back': 'Reading the copy back', test: 'Testing the mark', fidelity: 'Measuring what became of the shape',
  preparation: 'Preparing the original', matching: 'Matching the triangles', registration: 'Aligning', 'mirror image': 'Aligning the mirror image',
  extraction: 'Reading the mark', resampling: 'Resampling', tests: 'Testing',
};

const text = (id) => document.getElementById(id).textContent;
const workerAddress = URL.createObjectURL(new Blob([text('worker')], { type: 'text/javascript' }));
const program = compile();
// Whoever starts a task is told of the failure then.
program.catch(() => {});

/** The program, which the page carries packed. */
async function compile() {
  try {
    const packed = Uint8Array.from(atob(text('program')), (sign) => sign.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
    return await WebAssembly.compile(await new Response(stream).arrayBuffer());
  } catch (error) {
    throw new Error(`this browser cannot run the page’s program (${error.message}); use a newer one`);
  }
}

/** What ends a task that nobody wants any more. */
class Cancelled extends Error {}

/** A task in a worker of its own, so that it can be ended at any time. */
class Task {
  /** `parameters` may still be on their way. What is known `early` comes before the answer. */
  constructor(task, parameters, heard = () => {}, early = () => {}) {
    this.done = new Promise((resolve, reject) => {
      this.cancel = () => reject(new Cancelled());
      Promise.all([program, parameters]).then(([module, parameters]) => {
        if (this.over) return;
        this.worker = new Worker(workerAddress);
        this.worker.onmessage = ({ data }) => {
          if ('stage' in data) heard(data);
          else if ('early' in data) early(data.early);
          else if ('answer' in data) resolve(data.answer);
          else reject(new Error(data.failed));
        };
        this.worker.onerror = (event) => reject(new Error(`the program cannot be started (${event.message})`));
        this.worker.postMessage({ module, task, parameters });
      }).catch(reject);
    }).finally(() => {
      this.over = true;
      this.worker?.terminate();
    });
  }
}

/** The content of a file that is not too large. */
async function read(file) {
  if (file.size > LARGEST) {
    const size = Math.round(file.size / 2 ** 20);
    throw new Error(`${file.name}: ${size} MB, and this page reads files of up to ${LARGEST / 2 ** 20} MB, since a browser gives a page little memory; use the command sombrero for it`);
  }
  return new Uint8Array(await file.arrayBuffer());
}

/** An element with these properties and children. */
function made(name, properties = {}, ...children) {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...children);
  return element;
}

/** A page in a frame, which may run its own view and nothing else. */
function frame(title, html) {
  const element = made('iframe', { title });
  element.sandbox = 'allow-scripts';
  element.srcdoc = html;
  return element;
}

function save(words, { name, bytes }, type) {
  const address = URL.createObjectURL(new Blob([bytes], { type }));
  return made('a', { href: address, download: name }, `${words}: `, made('bdi', {}, name));
}

function figures(...rows) {
  const figure = ([name, value, meaning]) =>
    made('div', {}, made('dt', {}, name), made('dd', { className: 'value' }, value), made('dd', { className: 'meaning' }, meaning));
  return made('dl', { className: 'figures' }, ...rows.map(figure));
}

function notes(sentences) {
  return made('div', { className: 'notes' }, ...sentences.map((sentence) => made('p', {}, powers(sentence))));
}

/** A sentence whose powers of ten are set as such. */
function powers(sentence) {
  const parts = sentence.split(/10\^(-?[\d.]*\d)/);
  return made('bdi', {}, ...parts.flatMap((part, i) => (i % 2 ? ['10', made('sup', {}, part.replace('-', '−'))] : [part])));
}

const chance = (log10) => powers(log10 > -3 ? (10 ** log10).toPrecision(2) : `10^${Number(log10.toFixed(1))}`);

/** A form that does one task at a time. */
class Form {
  constructor(id, shown) {
    this.form = document.getElementById(id);
    for (const part of ['frame', 'actions', 'work', 'failure', 'result']) this[part] = this.form.querySelector(`.${part}`);
    this.form.addEventListener('submit', (event) => {
      event.preventDefault();
      this.submit();
    });
    this.form.querySelector('.cancel').addEventListener('click', () => this.task?.cancel());
    this.form.elements[shown].addEventListener('change', (event) => this.show(event.target.files[0]));
  }

  file(name) {
    return this.form.elements[name].files[0];
  }

  /** Shows the model that was chosen. */
  async show(file) {
    this.preview?.cancel();
    this.say(this.failure);
    this.say(this.frame);
    this.say(this.result);
    if (!file) return;
    try {
      this.preview = new Task('view', read(file).then((bytes) => [file.name, bytes]));
      this.say(this.frame, frame(`${file.name}, to be turned`, await this.preview.done));
    } catch (error) {
      this.fail(error);
    }
  }

  async submit() {
    this.busy(true);
    this.say(this.failure);
    this.say(this.result);
    try {
      this.task = new Task(this.form.id, this.parameters(), (news) => this.tell(news), (early) => this.add(this.early(early)));
      this.add(this.answered(await this.task.done));
    } catch (error) {
      this.fail(error);
    }
    this.busy(false);
  }

  busy(yes) {
    const [shown, gone] = yes ? [this.work, this.actions] : [this.actions, this.work];
    shown.hidden = false;
    // Whoever works with keys finds himself where the button was. What is hidden with the focus on it may lose it later.
    if (gone.contains(document.activeElement)) shown.querySelector('button').focus();
    gone.hidden = true;
    this.tell({ stage: 'reading', done: 0, of: 0 });
  }

  tell({ stage, done, of }) {
    this.work.querySelector('.stage-name').textContent = WORDS[stage] ?? stage;
    const progress = this.work.querySelector('progress');
    if (of > 0) Object.assign(progress, { max: of, value: done });
    else progress.removeAttribute('value');
  }

  fail(error) {
    if (error instanceof Cancelled) return;
    this.say(this.failure, made('bdi', {}, `${error.message}.`));
  }

  add(words) {
    this.say(this.result, ...this.result.childNodes, ...words);
  }

  say(place, ...words) {
    place.replaceChildren(...words);
    place.hidden = words.length === 0;
  }
}

class Mark extends Form {
  async parameters() {
    const model = this.file('model');
    const { owner, recipient } = this.form.elements;
    const secret = crypto.getRandomValues(new Uint8Array(32));
    return [model.name, await read(model), owner.value, recipient.value, secret];
  }

  early({ files: [copy, key] }) {
    return [
      made('h3', {}, 'Marked'),
      made('p', { className: 'saves' }, save('Save the copy', copy, 'application/octet-stream'), save('Save the key', key, 'application/json')),
      made('p', {}, 'Publish the copy. Keep the key together with the original, and show both to nobody: who has them can take the mark out.'),
    ];
  }

  answered({ figures: report }) {
    return [
      figures(
        ['vertices move by', `${(100 * report.distortion.relative_rms).toPrecision(2)} %`, 'Of the largest side, root mean square.'],
        ['normals turn by', `${report.fidelity.normals_rms.toFixed(2)}°`, 'Root mean square: what one could see.'],
        ['chance match', chance(report.log10_p), 'That an unmarked model matches the copy as well.'],
      ),
      notes(report.warnings),
    ];
  }
}

class Look extends Form {
  async parameters() {
    const parameters = [];
    for (const name of ['suspect', 'original', 'key']) parameters.push(this.file(name).name, await read(this.file(name)));
    return parameters;
  }

  answered({ files: [report], figures: { claim, notes: sentences, record } }) {
    const { detected, log10_p, threshold, coverage } = record;
    const html = new TextDecoder().decode(report.bytes);
    return [
      made('h3', { className: detected ? 'found' : 'not-found' }, detected ? 'The mark was found' : 'No mark was found'),
      made('p', {}, powers(claim)),
      figures(
        ['chance match', chance(log10_p), 'That an unmarked model would match as well.'],
        ['threshold', chance(Math.log10(threshold)), 'Found means that the chance is at most this.'],
        ['coverage', `${(100 * coverage).toFixed(0)} %`, 'Share of the original’s surface that was found on the suspect.'],
      ),
      notes(sentences),
      made('p', { className: 'saves' }, save('Save the report', report, 'text/html')),
      made('p', {}, 'The report holds nearly all that the key keeps secret. sombrero verify checks every figure of it.'),
      frame('The report', html),
    ];
  }
}

for (const drop of document.querySelectorAll('.drop')) {
  const input = drop.querySelector('input');
  drop.addEventListener('dragover', (event) => {
    event.preventDefault();
    drop.classList.add('over');
  });
  drop.addEventListener('dragleave', () => drop.classList.remove('over'));
  drop.addEventListener('drop', (event) => {
    event.preventDefault();
    drop.classList.remove('over');
    if (!event.dataTransfer.files.length) return;
    input.files = event.dataTransfer.files;
    input.dispatchEvent(new Event('change', { bubbles: true }));
  });
}
// A file that misses its field must not take the place of the page.
for (const name of ['dragover', 'drop']) document.addEventListener(name, (event) => event.preventDefault());

new Mark('mark', 'model');
new Look('look', 'suspect');
