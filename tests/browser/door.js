// Visits the page of the browser's door: chooses files, marks, cancels, looks. Stands after visitor.js and takes the place of its `visit`.

const given = JSON.parse(document.getElementById('given').textContent);
const decoded = (text) => Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));

async function visit(frame) {
  const [page, window] = [frame.contentDocument, frame.contentWindow];
  const [mark, look] = ['mark', 'look'].map((id) => page.getElementById(id));
  const seen = { large: await refused(window, look), nameless: nameless(page) };
  choose(window, mark, 'model', given.model, decoded(given.content));
  seen.shown = await comes(() => mark.querySelector('.frame iframe')) && mark.querySelector('.frame iframe').title;
  if (given.secret) Object.assign(seen, await marksAndLooks(page, window, mark, look));
  const { clientWidth: width, scrollWidth } = page.documentElement;
  Object.assign(seen, { width, content_width: Math.max(scrollWidth, page.body.scrollWidth) });
  seen.paper = window.getComputedStyle(page.body).backgroundColor;
  seen.nameless.push(...nameless(page));
  seen.least_contrast = leastContrast(page, window);
  seen.loaded = window.performance.getEntriesByType('resource').map((entry) => entry.name).filter((name) => !/^(data|blob):/.test(name));
  seen.connected = await window.fetch('data:text/plain,a').then(() => true, () => false);
  return seen;
}

async function marksAndLooks(page, window, mark, look) {
  const seen = {};
  const blobs = remembered(window);
  // The secret that the command is given too.
  window.crypto.getRandomValues = (array) => array.fill(given.secret);
  mark.elements.owner.value = 'A. Museum';
  seen.cancelled = await cancelled(page, mark);
  seen.marked = await done(mark);
  const saved = [...mark.querySelectorAll('.saves a')].map((a) => ({ name: a.download, blob: blobs.get(a.href) }));
  seen.saved = saved.map((file) => file.name);
  if (saved.length !== 2) return seen;
  const [copy, key] = saved;
  seen.measured = await comes(() => mark.querySelector('.figures') && !mark.querySelector('.actions').hidden);
  [seen.copy, seen.key] = [await encoded(copy.blob), await encoded(key.blob)];

  drop(window, look, 'suspect', copy.name, new Uint8Array(await copy.blob.arrayBuffer()));
  choose(window, look, 'original', given.model, decoded(given.content));
  choose(window, look, 'key', key.name, new Uint8Array(await key.blob.arrayBuffer()));
  await comes(() => look.querySelector('.frame iframe'));
  seen.verdict = await done(look);
  const report = look.querySelector('.saves a');
  seen.reported = report?.download;
  if (report) seen.report = await encoded(blobs.get(report.href));
  return seen;
}

/** What the page offers to save, by address. */
function remembered(window) {
  const blobs = new Map();
  const create = window.URL.createObjectURL;
  window.URL.createObjectURL = (blob) => {
    const address = create.call(window.URL, blob);
    blobs.set(address, blob);
    return address;
  };
  return blobs;
}

async function comes(condition, patience = 40000) {
  for (const end = performance.now() + patience; !condition() && performance.now() < end; ) await wait(10);
  return Boolean(condition());
}

function carried(window, file, bytes) {
  const carried = new window.DataTransfer();
  carried.items.add(new window.File([bytes], file));
  return carried;
}

function choose(window, form, name, file, bytes) {
  form.elements[name].files = carried(window, file, bytes).files;
  form.elements[name].dispatchEvent(new window.Event('change', { bubbles: true }));
}

function drop(window, form, name, file, bytes) {
  const dropped = { dataTransfer: carried(window, file, bytes), bubbles: true, cancelable: true };
  form.elements[name].closest('.drop').dispatchEvent(new window.DragEvent('drop', dropped));
}

/** What is said of a file of 200 MB. */
async function refused(window, form) {
  choose(window, form, 'suspect', 'large.stl', new Uint8Array(200 << 20));
  await comes(() => !form.querySelector('.failure').hidden);
  return form.querySelector('.failure').textContent;
}

/** Submits a form as the Enter key does, and gives the head of its result, or what failed. */
async function done(form) {
  form.requestSubmit();
  await wait(0);
  const [result, failure] = [form.querySelector('.result'), form.querySelector('.failure')];
  await comes(() => !result.hidden || !failure.hidden);
  return (result.hidden ? failure : result.querySelector('h3')).textContent;
}

/** Whether a task ends when it is cancelled, without a result, and where the focus is before and after. */
async function cancelled(page, form) {
  const [submit, cancel] = [form.querySelector('[type=submit]'), form.querySelector('.cancel')];
  submit.focus();
  submit.click();
  const during = page.activeElement === cancel;
  await wait(30);
  cancel.click();
  const over = await comes(() => !form.querySelector('.actions').hidden);
  const silent = form.querySelector('.result').hidden && form.querySelector('.failure').hidden;
  return { during, over, silent, after: page.activeElement === submit };
}

/** Elements that somebody who does not see them could not tell. */
function nameless(page) {
  const named = (element) => element.labels?.length || element.textContent.trim() || element.title;
  const elements = [...page.querySelectorAll('input, button, a, iframe, progress')];
  return elements.filter((element) => !named(element)).map((element) => element.outerHTML);
}

async function encoded(blob) {
  return base64(new Uint8Array(await blob.arrayBuffer()));
}
