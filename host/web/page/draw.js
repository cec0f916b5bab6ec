'use strict';
// This script draws the machines' state. It contains no machine.
const $ = (id) => document.getElementById(id);
const SVG = 'http://www.w3.org/2000/svg';
const STATES = ['A', 'B', '1', '2', '3', '4', 'CR'];
const MARKS = { pending: '·', delivered: '✓', wrong: '!' };
const AXES = ['pitch', 'roll', 'yaw'];

const hex = (byte) => byte.toString(16).toUpperCase().padStart(2, '0');
const character = (byte) => (byte === 13 ? 'CR' : byte > 32 && byte < 127 ? String.fromCharCode(byte) : '');

function element(name, properties = {}, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

function drawing(name, attributes, ...children) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

/** Sets a text only if it differs, so that the browser and screen readers do nothing for an unchanged text. */
function say(where, text) {
  if (where.textContent !== text) where.textContent = text;
}

function draw() {
  const room = Math.max(10, Math.min(40, Math.floor(($('cells').clientWidth + 2) / 28)));
  const from = Math.max(0, Math.min(position, page.bytes()) - Math.round(room * 0.7));
  view = JSON.parse(page.view(position, from, from + room));
  const slider = $('position');
  slider.max = view.positions;
  slider.value = position;
  slider.setAttribute('aria-valuetext', `byte ${position} of ${view.bytes}`);
  const silence = position > view.bytes ? ', silence' : '';
  say($('time'), `byte ${Math.min(position, view.bytes)} of ${view.bytes}${silence}, ${view.seconds.toFixed(2)} s`);
  say($('sentence'), view.sentence);
  drawCells(room);
  drawFates(room);
  fit($('machines'), view.machines.length, makeMachine).forEach((card, index) => drawMachine(card, view.machines[index]));
}

/** Adds or removes children until there are `count`. The other children stay, so that they keep the focus. */
function fit(parent, count, make) {
  while (parent.children.length < count) parent.append(make());
  while (parent.children.length > count) parent.lastChild.remove();
  return [...parent.children];
}

function fitRow(row, room, make) {
  row.style.gridTemplateColumns = `repeat(${room}, minmax(0, 1fr))`;
  return fit(row, room, make);
}

function drawCells(room) {
  const row = $('cells');
  const make = () => element('button', { tabIndex: -1 }, element('span'), element('small'));
  fitRow(row, room, make).forEach((node, index) => {
    const cell = view.cells[index];
    node.disabled = !cell;
    const byte = cell && (cell.received ?? cell.sent);
    const kind = cell ? cell.kind : 'nothing';
    const now = cell && cell.place + 1 === position;
    node.className = `cell ${kind} ${cell?.begins ? 'begins' : ''} ${!cell || cell.place >= position ? 'future' : ''} ${now ? 'now' : ''}`;
    say(node.firstChild, cell ? (byte === null ? '??' : hex(byte)) : '');
    say(node.lastChild, cell && byte !== null ? character(byte) : '');
    if (!cell) return;
    const fates = cell.fates.map((fate, machine) => fate && `${view.machines[machine].name}: ${fate}`);
    const has = cell.place < position ? '' : ', still to come';
    const label = `byte ${cell.place + 1}: ${node.textContent}, ${kind}${has}. ${fates.filter(Boolean).join('. ')}`;
    if (node.title !== label) {
      node.title = label;
      node.setAttribute('aria-label', label);
    }
  });
  if (!row.querySelector('[tabindex="0"]')) row.firstChild.tabIndex = 0;
}

function drawFates(room) {
  const make = () => element('div', {}, element('div', { className: 'who' }, element('span'), element('span')), element('div', { className: 'row' }));
  $('alone').hidden = view.machines.length > 1;
  fit($('fates'), view.machines.length, make).forEach((node, index) => {
    const machine = view.machines[index];
    const [who, row] = node.children;
    say(who.firstChild, machine.name);
    drawStatus(who.lastChild, machine);
    row.setAttribute('aria-hidden', 'true'); // the label of each byte contains the same text
    fitRow(row, room, () => element('i')).forEach((node, column) => {
      const fate = view.cells[column]?.fates[index];
      node.className = 'fate ' + (fate ? (MARKS[fate] ? fate : 'discarded') : '');
      node.title = fate ?? '';
      say(node, fate ? (MARKS[fate] ?? '×') : '');
    });
  });
}

function drawStatus(node, machine) {
  node.className = 'status ' + machine.status.split(' ')[0];
  const mark = { LISTENING: '✓ ', 'NO FRAME YET': '' }[machine.status] ?? '✕ ';
  const lasts = ['DEAF', 'MISREADING'].includes(machine.status) && machine.status_seconds >= 0.1;
  const since = lasts ? ` for ${machine.status_seconds.toFixed(1)} s` : '';
  say(node, mark + machine.status + since);
}

/** Creates a machine's card, and keeps the parts of it that change. */
function makeMachine() {
  const card = element('section', { className: 'machine' });
  const title = element('h2', {}, (card.who = element('span')), ' ', (card.status = element('span')));
  card.diagram = $('diagram').content.cloneNode(true).firstElementChild;
  card.diagram.classList.add('diagram');
  STATES.forEach((state, index) => {
    const x = 24 + 45 * index;
    const circle = drawing('circle', { cx: x, cy: 44, r: 15 });
    card.diagram.querySelector('.states').append(drawing('g', { 'data-state': state }, circle, drawing('text', { x, y: 49 }, state)));
  });
  card.legs = AXES.map((axis, index) => {
    const x = 25 + 50 * index;
    const leg = drawing('rect', { class: 'leg', x: x - 14, y: 5, width: 28, height: 8, rx: 2 });
    const aim = drawing('line', { class: 'aim', x1: x - 20, x2: x + 20, y1: 9, y2: 9 });
    const rod = drawing('line', { class: 'rod', x1: x, x2: x, y1: 112, y2: 9 });
    const track = drawing('line', { class: 'track', x1: x, x2: x, y1: 9, y2: 112 });
    return { parts: [track, rod, leg, aim, drawing('text', { x, y: 126 }, axis)], leg, aim, rod };
  });
  const legs = drawing('svg', { viewBox: '0 0 150 130', role: 'img' }, ...card.legs.flatMap((leg) => leg.parts));
  Object.assign(card, { picture: legs, values: element('table'), counts: element('table'), window: element('div', { className: 'window' }) });
  card.reason = element('p', { className: 'hint reason' });
  Object.assign(card, { axes: element('div', { className: 'axes' }, card.values, legs, card.reason), fields: element('table', { className: 'given' }) });
  const caption = element('small', { textContent: 'Pending bytes: they may begin a frame' });
  card.given = element('div', {}, element('small', { textContent: 'The last delivered frame' }), card.fields);
  card.append(title, card.axes, card.diagram, caption, card.window, card.given, card.counts);
  return card;
}

function drawMachine(card, machine) {
  card.setAttribute('aria-label', machine.name);
  say(card.who, machine.name);
  drawStatus(card.status, machine);
  card.diagram.classList.toggle('hidden', machine.state === null);
  card.diagram.setAttribute('aria-label', `The lecture's seven states; the machine is in ${machine.state}`);
  for (const state of card.diagram.querySelectorAll('[data-state]')) {
    state.classList.toggle('lit', state.dataset.state === machine.state);
  }
  card.window.replaceChildren(...machine.window.map((byte) => element('div', { className: 'slot' }, hex(byte))));
  if (machine.pending > machine.window.length) card.window.append(element('div', {}, `and ${machine.pending - machine.window.length} more`));
  card.axes.hidden = !machine.axes;
  card.given.hidden = machine.axes || machine.fields.length === 0;
  if (machine.axes) drawAxes(card, machine.axes);
  else rows(card.fields, machine.fields);
  const { tally, counters } = machine;
  const reasons = Object.entries(counters.discarded).filter(([, count]) => count > 0);
  const why = reasons.map(([reason, count]) => `${reason.replace('_', ' ')} ${count}`).join(', ');
  rows(card.counts, [
    ['whole frames delivered', tally.delivered],
    ['whole frames missed', tally.missed],
    ['delivered frames that nobody sent', tally.wrong],
    ['bytes received', counters.bytes],
    ['bytes discarded' + (why && `: ${why}`), reasons.reduce((sum, [, count]) => sum + count, 0)],
  ]);
}

function drawAxes(card, { temporary, setpoint, output, phase, reason }) {
  const cell = (byte) => (byte === null || byte === undefined ? '–' : byte);
  rows(card.values, [
    ['', 'temporary', 'current', 'actuator'],
    ...AXES.map((axis, index) => [axis, cell(temporary[index]), cell(setpoint?.[axis]), output[axis]]),
    ['failsafe', '', '', phase.toUpperCase()],
  ]);
  say(card.reason, reason ? `${phase}: ${reason}` : '');
  card.picture.setAttribute('aria-label', `Actuators: ${AXES.map((axis) => `${axis} ${output[axis]}`).join(', ')}; failsafe ${phase}`);
  AXES.forEach((axis, index) => {
    const height = (value) => 100 - (value / 255) * 96;
    const { leg, aim, rod } = card.legs[index];
    leg.style.transform = `translateY(${height(output[axis])}px)`;
    rod.setAttribute('y2', height(output[axis]) + 9);
    aim.style.transform = `translateY(${height(setpoint?.[axis] ?? 128)}px)`;
    aim.classList.toggle('hidden', !setpoint);
  });
}

function rows(table, rows) {
  table.replaceChildren(...rows.map((row) => element('tr', {}, ...row.map((text, column) => element(column ? 'td' : 'th', { textContent: text })))));
}

