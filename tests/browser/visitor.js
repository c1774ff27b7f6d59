// Visits the report in the frame of this page and writes down what it met, as base64 of JSON.

// The browser writes the page out once it has loaded. A document that is still being written holds that up.
const hold = document.querySelector('iframe').contentDocument;
hold.open();

function wait(milliseconds) {
  return new Promise((resolve) => setTimeout(resolve, milliseconds));
}

async function visit(frame) {
  const [page, window] = [frame.contentDocument, frame.contentWindow];
  const seen = { state: page.getElementById('view').dataset.state, ...appearance(page, window) };
  seen.evidence = JSON.parse(page.getElementById('sombrero-evidence').textContent);
  seen.loaded = window.performance.getEntriesByType('resource').filter((entry) => !entry.name.startsWith('data:')).length;
  if (seen.state === 'ready') Object.assign(seen, await play(page, window));
  return seen;
}

function appearance(page, window) {
  const { clientWidth: width, scrollWidth } = page.documentElement;
  return {
    width,
    content_width: Math.max(scrollWidth, page.body.scrollWidth),
    paper: window.getComputedStyle(page.body).backgroundColor,
    missing_shown: page.getElementById('view-missing').offsetHeight > 0,
    canvas_printed: !printHides(page, '.view'),
    least_contrast: leastContrast(page, window),
  };
}

function printHides(page, selector) {
  const rules = [...page.styleSheets].flatMap((sheet) => [...sheet.cssRules]);
  const print = rules.filter((rule) => rule.media?.mediaText === 'print').flatMap((rule) => [...rule.cssRules]);
  return print.some((rule) => rule.selectorText.split(', ').includes(selector) && rule.style.display === 'none');
}

/** Presses every button and key, drags, and turns the wheel. */
async function play(page, window) {
  const [view, canvas] = [page.getElementById('view'), page.querySelector('canvas')];
  const seen = { drawn: {} };
  // A busy machine draws late, so what is to come is waited for.
  const comes = async (condition, patience = 5000) => {
    for (const end = performance.now() + patience; !condition() && performance.now() < end; ) await wait(20);
    return condition();
  };
  const changes = async (act, patience) => {
    await wait(50);
    const before = view.dataset.eye;
    act();
    return comes(() => view.dataset.eye !== before, patience);
  };
  const key = (name) => canvas.dispatchEvent(new window.KeyboardEvent('keydown', { key: name, cancelable: true }));
  const wheel = () => canvas.dispatchEvent(new window.WheelEvent('wheel', { deltaY: 200, cancelable: true }));

  await comes(() => view.dataset.frames > 1);
  await wait(300);
  const start = view.dataset.eye;
  const frames = view.dataset.frames;
  await wait(1000);
  seen.frames_while_idle = view.dataset.frames - frames;
  for (const button of page.querySelectorAll('[data-mode]')) {
    button.click();
    await wait(100);
    seen.drawn[view.dataset.mode] = Number(view.dataset.drawn);
  }
  seen.wheel_without_focus = await changes(wheel, 300);
  canvas.focus();
  seen.key_turns = (await changes(() => key('ArrowLeft'))) && (await changes(() => key('ArrowUp')));
  seen.key_zooms = await changes(() => key('+'));
  seen.drag_turns = await changes(() => drag(canvas, window));
  canvas.dispatchEvent(new window.FocusEvent('focus'));
  seen.wheel_zooms = await changes(wheel);
  page.querySelector('[data-reset]').click();
  seen.reset_returns = await comes(() => view.dataset.eye === start);
  return seen;
}

function drag(canvas, window) {
  const at = (type, x, target) =>
    target.dispatchEvent(
      new window.PointerEvent(type, { pointerId: 1, pointerType: 'mouse', clientX: x, clientY: 50, bubbles: true }),
    );
  // No such pointer exists, so none can be captured.
  canvas.setPointerCapture = canvas.releasePointerCapture = () => {};
  at('pointerdown', 50, canvas);
  at('pointermove', 90, canvas);
  at('pointerup', 90, canvas);
}

/** The text that stands out least, by the contrast ratio of the Web Content Accessibility Guidelines. */
function leastContrast(page, window) {
  let least = { ratio: 21 };
  const texts = page.createTreeWalker(page.body, window.NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const element = texts.currentNode.parentElement;
    const shown = element.getClientRects().length && !element.closest('script, title, desc');
    if (!shown || !texts.currentNode.data.trim()) continue;
    const style = window.getComputedStyle(element);
    const color = luminance(element.closest('svg') ? style.fill : style.color);
    const ground = luminance(background(element, window));
    const ratio = (Math.max(color, ground) + 0.05) / (Math.min(color, ground) + 0.05);
    if (ratio < least.ratio) least = { ratio, text: texts.currentNode.data };
  }
  return least;
}

function background(element, window) {
  for (let at = element; at; at = at.parentElement) {
    const color = window.getComputedStyle(at).backgroundColor;
    if (color !== 'rgba(0, 0, 0, 0)') return color;
  }
  return 'rgb(255, 255, 255)';
}

function luminance(color) {
  const [r, g, b] = color.match(/[\d.]+/g).map((c) => (c / 255 <= 0.04045 ? c / 3294.6 : ((c / 255 + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}

/** A report holds more bytes than a function takes arguments. */
function base64(bytes) {
  return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(''));
}

async function begin(frame) {
  const seen = await visit(frame).catch((error) => ({ failed: String(error.stack) }));
  document.querySelector('output').textContent = base64(new TextEncoder().encode(JSON.stringify(seen)));
  hold.close();
}
