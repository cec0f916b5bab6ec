'use strict';
// This script turns clicks into calls of the machines and keeps the page's address up to date.
let page = null;
let presets = [];
let shown = ''; // the frame format for which the settings are shown
let view = null;
let position = 0;
let playing = false;
let edited = null; // the place on the line of the byte being edited
let written = 0; // the time of the last request to write the address
let later = 0; // the timer that will write the address
let typed = 0; // the timer since the last keystroke in the description

function complain(error) {
  $('error').hidden = !error;
  say($('error'), error ? String(error) : '');
}

/** Opens the scenario of an address. */
function open(address) {
  clearTimeout(typed);
  pause();
  let next;
  try {
    next = wasm_bindgen.Run.open(address);
  } catch (error) {
    return complain(error);
  }
  complain('');
  page?.free();
  page = next;
  position = page.position();
  closeEditor();
  draw();
  sayPlay();
  showSettings();
  remember();
}

/** Shows the mistake in a description while the user types, or its frames once it is valid. */
function describe() {
  clearTimeout(typed);
  typed = setTimeout(() => {
    const text = $('description').value;
    const problem = wasm_bindgen.problem(text);
    showProblem(problem || 'The description is valid.', problem);
    if (!problem) change(`edits=&frame=own&description=${encodeURIComponent(text)}`);
  }, 300);
}

function showProblem(text, wrong = false) {
  say($('problem'), text);
  $('description').setAttribute('aria-invalid', Boolean(wrong));
}

/** Writes the current view to the address, after a delay because browsers limit how often a page may do so. */
function remember() {
  written = performance.now();
  clearTimeout(later);
  later = setTimeout(() => history.replaceState(null, '', '#' + page.with(`at=${position}`)), 200);
}

function change(pairs) {
  try {
    open(page.with(`at=${position}&${pairs}`));
  } catch (error) {
    complain(error);
  }
}

function showSettings() {
  const settings = new URLSearchParams(page.with(''));
  for (const control of document.querySelectorAll('[data-key]')) {
    const value = settings.get(control.dataset.key);
    if (control.type === 'checkbox') control.checked = value === 'on';
    else control.value = value;
  }
  $('own').value = (settings.get('bytes') ?? '').replace(/..(?=.)/g, '$& ');
  const frame = settings.get('frame');
  if (frame !== shown) $('described').open = frame === 'own';
  shown = frame;
  if (document.activeElement !== $('description')) {
    $('description').value = page.description();
    showProblem('');
  }
  const scenario = page.with('at=0');
  let explanation = '';
  presets.forEach((preset, index) => {
    const chosen = preset.address === scenario;
    $('presets').children[index].setAttribute('aria-pressed', chosen);
    if (chosen) explanation = preset.explanation;
  });
  say($('explanation'), explanation || 'This is your own line. The address contains all of it, so you can share it as a link.');
}

function go(to) {
  position = Math.max(0, Math.min(to, view.positions));
  draw();
  sayPlay();
  if (!playing || performance.now() - written > 1000) remember();
}

function play() {
  if (playing) return pause();
  if (position >= view.positions) position = 0;
  // Playing stops after the last byte. Another click plays the silence after it.
  const end = position < view.bytes ? view.bytes : view.positions;
  playing = true;
  sayPlay();
  // While playing, a screen reader would announce every step.
  $('sentence').setAttribute('aria-live', 'off');
  let last = performance.now();
  let due = 0;
  const frame = (now) => {
    if (!playing) return;
    due += ((now - last) / 1000) * (view.bytes < 60 ? 7 : 30);
    last = now;
    const steps = Math.floor(due);
    due -= steps;
    if (steps > 0) go(Math.min(end, position + steps));
    if (position >= end) return pause();
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
}

function pause() {
  if (!playing) return;
  playing = false;
  sayPlay();
  $('sentence').setAttribute('aria-live', 'polite');
  say($('sentence'), '');
  if (view) go(position);
}

function sayPlay() {
  say($('play'), playing ? 'Pause' : 'Play');
}

function stop(at) {
  pause();
  go(at);
}

function openEditor(node) {
  const cell = view.cells[[...$('cells').children].indexOf(node)];
  if (!cell) return;
  pause();
  edited = cell.place;
  const byte = cell.received ?? cell.sent;
  say($('edited'), `Byte ${edited + 1}: ${byte === null ? 'not received' : `${hex(byte)} ${character(byte)}`}, ${cell.kind}`);
  say($('drop'), cell.kind === 'inserted' ? 'Remove' : cell.kind === 'lost' ? 'Do not drop' : 'Drop');
  $('editor').hidden = false;
}

function closeEditor() {
  edited = null;
  $('editor').hidden = true;
}

function edit(action, value = 0) {
  const place = edited;
  const pressed = document.activeElement;
  open(`${page.edited(place, action, value)}&at=${position}`);
  const node = $('cells').children[view.cells.findIndex((cell) => cell.place === place)];
  if (action !== 'flip' || !node) return focusCell(node);
  openEditor(node); // the user may flip another bit
  pressed.focus();
}

function focusCell(node) {
  if (!node || node.disabled) return;
  for (const other of $('cells').children) other.tabIndex = other === node ? 0 : -1;
  node.focus();
}

/** Sends these bytes instead of frames, or frames if there are no bytes, and plays. */
function sendBytes(text) {
  const before = page;
  change(`edits=&at=0&bytes=${text}`);
  if (page !== before) play();
}

function listen() {
  $('play').onclick = play;
  $('step').onclick = () => stop(position + 1);
  $('back').onclick = () => stop(position - 1);
  $('start').onclick = () => stop(0);
  $('position').oninput = (event) => stop(Number(event.target.value));
  $('cells').onclick = (event) => {
    openEditor(event.target.closest('button'));
    $('drop').focus();
  };
  $('cells').onkeydown = (event) => {
    const node = event.target.closest('button');
    const to = { ArrowLeft: node.previousSibling, ArrowRight: node.nextSibling }[event.key];
    if (event.key === 'Delete') {
      openEditor(node);
      edit('drop');
    } else if (to === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    focusCell(to);
  };
  $('drop').onclick = () => edit('drop');
  $('insert').onclick = () => {
    const value = $('value').value;
    if (!/^[0-9a-f]{1,2}$/i.test(value)) return complain(`${value}: expected two hexadecimal digits`);
    edit('insert', parseInt(value, 16));
  };
  $('close').onclick = closeEditor;
  for (let bit = 7; bit >= 0; bit--) {
    $('bits').append(element('button', { textContent: bit, ariaLabel: `Flip bit ${bit}`, onclick: () => edit('flip', 1 << bit) }));
  }
  for (const control of document.querySelectorAll('[data-key]')) {
    control.onchange = () => {
      const value = control.type === 'checkbox' ? (control.checked ? 'on' : 'off') : control.value.trim();
      change(`${control.dataset.key}=${value}${control.dataset.key === 'frame' ? '&edits=' : ''}`);
    };
  }
  $('description').oninput = describe;
  $('send').onclick = () => sendBytes($('own').value);
  $('own').onkeydown = (event) => void (event.key === 'Enter' && $('send').click());
  onkeydown = (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.target.closest('input, select, textarea')) return;
    if (event.key === 'Escape') return closeEditor();
    const to = { ArrowLeft: position - 1, ArrowRight: position + 1, Home: 0, End: view.bytes }[event.key];
    if (event.key === ' ' && !event.target.closest('button, summary')) play();
    else if (to !== undefined) stop(to);
    else return;
    event.preventDefault();
  };
  onresize = () => view && draw();
  onhashchange = () => open(location.hash.slice(1));
}

function show(preset) {
  open(preset.address);
  play();
}

async function main() {
  const bytes = Uint8Array.from(atob(MACHINES), (character) => character.charCodeAt(0));
  const unpacked = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
  await wasm_bindgen({ module_or_path: await new Response(unpacked).arrayBuffer() });
  presets = JSON.parse(wasm_bindgen.presets());
  $('presets').append(...presets.map((preset) => element('button', { textContent: preset.name, onclick: () => show(preset) })));
  const frames = JSON.parse(wasm_bindgen.frames());
  document.querySelector('[data-key=frame]').append(...frames.map(([value, about]) => element('option', { value, textContent: `${value}: ${about}` })));
  listen();
  const address = location.hash.slice(1);
  if (address) open(address);
  if (page) return;
  const complaint = $('error').textContent;
  open(presets[0].address);
  if (!complaint) return matchMedia('(prefers-reduced-motion: reduce)').matches || play();
  // Keep the address, so that the user can correct it.
  complain(complaint);
  clearTimeout(later);
  history.replaceState(null, '', '#' + address);
}

/** Returns the page's state as JSON, for tests and for curious users. */
window.framelock = () => JSON.stringify({ playing, error: $('error').textContent, problem: $('problem').textContent, address: page?.with(`at=${position}`), ...view });

main().catch(complain);
