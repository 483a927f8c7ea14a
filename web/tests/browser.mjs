// The page in Chromium: node browser.mjs PAGE FOLDER. Pictures go to FOLDER.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { goldenFrames, serialPort, simulator, typesOf } from './knob.mjs';
import { scores } from './module.mjs';
import { DYNAMIC, HEARD, KEY, LEVEL, SILENT, SOUNDING, latest, launch, open, pictures, running, serve, settled, silence, until } from './page.mjs';
import { QUIET_S, SENTENCES, blow, room, sequence, speech, writeWav } from './sounds.mjs';

const [folder, own] = process.argv.slice(2);
/** `chalumeau` with the simulated knob. */
const PROGRAM = process.env.CHALUMEAU ?? new URL('../../target/debug/chalumeau', import.meta.url).pathname;
/** Types of frames (docs/protocol.md), and the session of the golden ones. */
const [HELLO, ARM, FREE, BYE] = [0x01, 0x03, 0x05, 0x08];
const GOLDEN_SESSION = 0xdeadbeef;
/** Longest time until a knob is free after a sign of life has stopped: 500 ms of patience, and as much for a busy machine, ms. */
const FREE_MS = 1000;
/** Without a graphics processor the pictures would hold the page up for longer than a knob waits. */
const SLOW = 'globalThis.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 250)';
/** A page whose sound runs at the rate of the native code's pitches. */
const AT_48_KHZ = `globalThis.AudioContext = class extends AudioContext {
  constructor(options) { super({ ...options, sampleRate: 48000 }); }
}`;
const SIZES = { phone: [390, 844], tablet: [820, 1180], desktop: [1440, 900] };

const server = await serve(folder);
/** Frequency of a steady tone within a semitone of another, Hz: the autocorrelation's peak some periods away. */
function pitchHz(sound, near) {
  const periods = 40;
  const correlation = (lag) => {
    let sum = 0;
    for (let n = 0; n + lag < sound.length; n += 1) sum += sound[n] * sound[n + lag];
    return sum / (sound.length - lag);
  };
  const middle = Math.round((periods * 48000) / near);
  const half = Math.floor(middle / periods / 2) - 1;
  const values = Array.from({ length: 2 * half + 1 }, (_, n) => correlation(middle - half + n));
  const top = values.indexOf(Math.max(...values));
  const [a, b, c] = [values[top - 1], values[top], values[top + 1]];
  return (periods * 48000) / (middle - half + top + (a - c) / (2 * (a - 2 * b + c)));
}

/** Moves a hole by hand and by number, saves and opens it; with the fit, which takes its time, or without. */
async function dragHole(browser, withFit) {
  const golden = JSON.parse(readFileSync(new URL('moved_holes.json', import.meta.url)));
  const [{ name, x_m }] = golden.moved;
  const { page, context, errors } = await open(browser, server.address, { before: AT_48_KHZ, serviceWorkers: 'block' });
  await page.evaluate(() => {
    globalThis.heard = [];
    addEventListener('moved', ({ detail }) => globalThis.heard.push(detail));
  });
  await page.click('#holes');
  // By hand first: the hole follows the pointer. The clarinet is drawn anew for the room that the button leaves: wait for it.
  const seen = () => page.evaluate((hole) => {
    const box = document.getElementById('clarinet').getBoundingClientRect();
    const { drawing, holes } = globalThis.chalumeau.holes;
    const [x, y] = drawing.place(holes[hole]);
    return [box.left + x, box.top + y, drawing.scale];
  }, golden.hole);
  let at;
  do {
    at = await seen();
    await page.waitForTimeout(100);
  } while (String(at) !== String(await seen()));
  await page.mouse.move(at[0], at[1]);
  await page.mouse.down();
  await page.mouse.move(at[0] - 0.003 * at[2], at[1], { steps: 4 });
  await page.mouse.up();
  assert.equal(await page.inputValue('#hole'), String(golden.hole));
  const place = () => page.inputValue('#hole-place').then(Number);
  const before = golden.built_mm;
  assert.ok(Math.abs((await place()) - (before - 3)) < 0.6, `${await place()} mm, from ${before}`);
  // Then exactly, by its number.
  await page.fill('#hole-place', (1e3 * x_m).toFixed(1));
  await page.press('#hole-place', 'Enter');
  const heard = async (isFitted) => {
    const found = await page.waitForFunction(
      ([name, x, isFitted]) => {
        const it = globalThis.chalumeau.holes.moved.find((hole) => hole.name === name);
        return Math.abs(it.x_m - x) < 1e-6 && globalThis.heard.filter((heard) => heard.isFitted === isFitted && heard.file.includes(`x_mm = ${(1e3 * x).toFixed(1)}`)).at(-1);
      },
      [name, x_m, isFitted],
      { timeout: 120000 },
    );
    return found.jsonValue();
  };
  const pitches = {};
  const sounds = { at_once_hz: await heard(false) };
  if (withFit) sounds.fitted_hz = await heard(true);
  for (const [which, { file, prepared }] of Object.entries(sounds)) {
    const sound = await page.evaluate(async ({ file, prepared, note }) => {
      const offline = new OfflineAudioContext(2, 72000, 48000);
      await offline.audioWorklet.addModule('worklet.js');
      const module = await WebAssembly.compile(await (await fetch('chalumeau.wasm')).arrayBuffer());
      const bytes = (text) => new TextEncoder().encode(text);
      const node = new AudioWorkletNode(offline, 'chalumeau', {
        outputChannelCount: [2],
        processorOptions: { module, instrument: 0, prepared: { file: bytes(file), prepared: bytes(prepared) }, score: { score: [[0, 0x90, note, 100]] } },
      });
      node.connect(offline.destination);
      return Array.from((await offline.startRendering()).getChannelData(0).slice(36000));
    }, { file, prepared, note: golden.note });
    pitches[which] = 1200 * Math.log2(pitchHz(sound, golden[which]) / golden[which]);
    assert.ok(Math.abs(pitches[which]) < 1, `${which}: ${pitches[which]} cents from the native code`);
  }
  // It is what the page plays, too.
  await page.click('#hole-done');
  await page.keyboard.down('d');
  await until(page, LEVEL, HEARD);
  await page.keyboard.up('d');
  await page.click('#holes');
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('#hole-save')]);
  const saved = await download.path();
  await page.click('#hole-back');
  assert.equal(await place(), before);
  await page.click('#hole-undo');
  assert.ok(Math.abs((await place()) - 1e3 * x_m) < 0.06);
  await page.click('#hole-back');
  await page.setInputFiles('#hole-file', saved);
  await page.waitForFunction(([name, x]) => globalThis.chalumeau.holes.moved.some((hole) => hole.name === name && Math.abs(hole.x_m - x) < 1e-6), [name, x_m]);
  await page.setInputFiles('#hole-file', { name: 'none.toml', mimeType: 'text/plain', buffer: Buffer.from('bore = 3') });
  await page.waitForFunction(() => /^none.toml is not opened. This is not a Chalumeau instrument file/.test(document.getElementById('hole-state').textContent));
  assert.deepEqual(errors, []);
  await context.close();
  return `${Object.entries(pitches).map(([which, cents]) => `${which} ${cents.toFixed(2)} cents`).join(', ')}`;
}

/** The tests of one browser, each on a page of its own. */
const TESTS = {
  async 'a key sounds within two seconds of the gesture, and stops'(browser) {
    const { page, context, errors } = await open(browser, server.address, { early: true, serviceWorkers: 'block' });
    const began = Date.now();
    await page.keyboard.down('d');
    await until(page, LEVEL, HEARD);
    const took = Date.now() - began;
    assert.ok(took < 2000, `${took} ms`);
    assert.equal((await latest(page))[SOUNDING], 64);
    assert.equal(await page.textContent('#written'), 'F♯4');
    assert.equal(await page.textContent('#sounding'), 'written · sounds E4');
    // A second key slurs; the first is heard again.
    await page.keyboard.down('f');
    await until(page, SOUNDING, 65, 66);
    await page.keyboard.up('f');
    await until(page, SOUNDING, 64, 65);
    const loud = await settled(page, DYNAMIC);
    for (let n = 0; n < 4; n += 1) await page.keyboard.press('ArrowDown');
    await until(page, DYNAMIC, 0, loud - 0.1);
    await page.keyboard.up('d');
    await silence(page);
    await page.keyboard.down('d');
    await until(page, LEVEL, HEARD);
    await page.keyboard.press('Escape');
    await silence(page);
    assert.deepEqual(errors, []);
    await context.close();
    return `${took} ms`;
  },

  async 'a drag plays: right is higher, up is louder'(browser) {
    const { page, context, errors } = await open(browser, server.address, { serviceWorkers: 'block' });
    const box = await page.locator('#clarinet').boundingBox();
    const at = (x, y) => [box.x + x * box.width, box.y + y * box.height];
    await page.mouse.move(...at(0.3, 0.7));
    await page.mouse.down();
    await until(page, LEVEL, HEARD);
    const soft = await latest(page);
    await page.mouse.move(...at(0.3, 0.15), { steps: 8 });
    await until(page, DYNAMIC, soft[DYNAMIC] + 0.3);
    await page.mouse.move(...at(0.6, 0.15), { steps: 12 });
    await until(page, SOUNDING, soft[SOUNDING] + 6);
    await page.mouse.up();
    await silence(page);
    // The piano's keys, by the mouse.
    const keys = await page.locator('#keyboard').boundingBox();
    await page.mouse.move(keys.x + 0.4 * keys.width, keys.y + 0.9 * keys.height);
    await page.mouse.down();
    await until(page, LEVEL, HEARD);
    await page.mouse.up();
    await silence(page);
    assert.deepEqual(errors, []);
    await context.close();
  },

  async 'two fingers on a phone slur, and the last one ends it'(browser) {
    const options = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true, serviceWorkers: 'block' };
    const { page, context, errors } = await open(browser, server.address, options);
    await page.touchscreen.tap(40, 24);
    const session = await context.newCDPSession(page);
    const box = await page.locator('#keyboard').boundingBox();
    const finger = (id, share) => ({ id, x: box.x + share * box.width, y: box.y + 0.9 * box.height });
    const touch = (type, ...touchPoints) => session.send('Input.dispatchTouchEvent', { type, touchPoints });
    await touch('touchStart', finger(1, 0.3));
    await until(page, LEVEL, HEARD);
    const first = (await latest(page))[SOUNDING];
    await touch('touchStart', finger(1, 0.3), finger(2, 0.7));
    await until(page, SOUNDING, first + 1);
    await touch('touchEnd', finger(2, 0.7));
    await until(page, SOUNDING, first, first + 1);
    await touch('touchEnd', finger(1, 0.3));
    await silence(page);
    assert.deepEqual(errors, []);
    await context.close();
  },

  async 'the worklet plays the bits of the Rust code'(browser) {
    const { page, context } = await open(browser, server.address, { serviceWorkers: 'block' });
    let seconds = 0;
    for (const score of scores()) {
      const hash = await page.evaluate(async ({ instrument, rate, samples, messages }) => {
        const offline = new OfflineAudioContext(2, samples, rate);
        await offline.audioWorklet.addModule('worklet.js');
        const module = await WebAssembly.compile(await (await fetch('chalumeau.wasm')).arrayBuffer());
        const node = new AudioWorkletNode(offline, 'chalumeau', {
          outputChannelCount: [2],
          processorOptions: { module, instrument, score: { score: messages } },
        });
        node.connect(offline.destination);
        const [left, right] = await offline.startRendering().then((made) => [0, 1].map((channel) => made.getChannelData(channel)));
        const both = new Float32Array(2 * samples);
        left.forEach((sample, n) => both.set([sample, right[n]], 2 * n));
        const digest = new Uint8Array(await crypto.subtle.digest('SHA-256', both));
        return Array.from(digest, (byte) => byte.toString(16).padStart(2, '0')).join('');
      }, score);
      assert.equal(hash, score.hash, score.name);
      seconds += score.samples / score.rate;
    }
    await context.close();
    return `${scores().length} scores, ${seconds.toFixed(0)} s`;
  },

  async 'MIDI plays, and the breath that it brings is named'(browser) {
    const before = () => {
      const input = { name: 'Wind controller', state: 'connected' };
      globalThis.wind = (...bytes) => input.onmidimessage({ data: new Uint8Array(bytes) });
      navigator.requestMIDIAccess = async () => ({ inputs: new Map([['1', input]]) });
    };
    const { page, context, errors } = await open(browser, server.address, { before, serviceWorkers: 'block' });
    await page.click('#midi');
    assert.equal(await page.getAttribute('#midi', 'aria-pressed'), 'true');
    const wind = (...bytes) => page.evaluate((bytes) => globalThis.wind(...bytes), bytes);
    await wind(0xb0, 2, 0);
    await wind(0x90, 60, 100);
    for (let breath = 8; breath <= 90; breath += 2) await wind(0xb0, 2, breath);
    await until(page, LEVEL, HEARD);
    await page.waitForFunction(() => document.getElementById('breathing').textContent === 'Breath: CC2');
    assert.equal((await latest(page))[KEY], 60);
    const loud = await settled(page, DYNAMIC);
    await wind(0xb0, 2, 30);
    await until(page, DYNAMIC, 0, loud - 0.2);
    await wind(0xe0, 0, 96);
    await wind(0xb0, 1, 64);
    await wind(0x80, 60, 0);
    await wind(0xb0, 2, 0);
    await silence(page);
    assert.deepEqual(errors, []);
    await context.close();
  },

  async 'a browser without Web Serial says who has it'(browser) {
    const { page, context, errors } = await open(browser, server.address, { before: 'delete Navigator.prototype.serial', serviceWorkers: 'block' });
    await page.click('#knob');
    await page.waitForFunction(() => /Chrome.*Edge.*Firefox/.test(document.getElementById('hint').textContent));
    assert.deepEqual(errors, []);
    await context.close();
  },

  async 'the knob speaks golden frames, and a knob that armed itself is freed'(browser) {
    const frames = goldenFrames();
    const frame = (name) => frames.find((frame) => frame.name === name).bytes;
    const { page, context, errors } = await open(browser, server.address, { before: serialPort(undefined, GOLDEN_SESSION), serviceWorkers: 'block' });
    await page.click('#knob');
    await page.waitForFunction(() => globalThis.serialPort.written.length > 0);
    const written = () => page.evaluate(() => globalThis.serialPort.written);
    assert.deepEqual((await written()).slice(0, frame('hello').length), frame('hello'), 'the first bytes');
    const feed = (bytes) => page.evaluate((bytes) => globalThis.serialPort.feed(bytes), bytes);
    const bad = frames.filter(({ verdict }) => verdict !== 'ok');
    for (const { bytes } of bad) await feed(bytes);
    // The line may be between two speeds.
    const who = () => page.textContent('#knob-who');
    for (let tries = 0; tries < 100 && !/TorqueTuner [0-9a-f]{16} .firmware 0.2.345.*WARNING/.test(await who()); tries += 1) {
      await feed([...frame('info'), ...frame('state')]);
      await page.waitForTimeout(100);
    }
    assert.match(await who(), /TorqueTuner [0-9a-f]{16} .firmware 0.2.345.*WARNING/);
    const types = typesOf(await written());
    assert.ok(types.includes(FREE) && !types.includes(ARM), `types ${types}`);
    assert.equal(types[0], HELLO);
    assert.deepEqual(errors, []);
    await context.close();
    return `${bad.length} bad frames did nothing`;
  },

  async 'the page plays the simulated knob, and no program arms it'(browser) {
    const knob = await simulator(PROGRAM, '--hold', '150');
    const { page, context, errors } = await open(browser, server.address, { before: `${serialPort(knob.address)};${SLOW}`, serviceWorkers: 'block' });
    const isFree = (state) => !state.armed && state.torque === 0;
    try {
      await page.click('#knob');
      await page.waitForFunction(() => /TorqueTuner/.test(document.getElementById('knob-who').textContent), null, { timeout: 20000 });
      await page.waitForFunction(() => globalThis.chalumeau.knob.plays);
      // The angle is the breath: the note that the page fingers sounds.
      await page.keyboard.down('d');
      await until(page, LEVEL, HEARD, Infinity, 30000);
      await until(page, SOUNDING, 64, 65);
      await until(page, 8, 5, 6);
      // A busy machine that also makes a sound answers the knob too late.
      await page.keyboard.up('d');
      await page.keyboard.press('Escape');
      await silence(page);
      // FEEL has arrived, the knob stands at its zero, and nothing but the user's own click arms.
      await page.click('#knob-zero');
      await page.waitForFunction(() => /^-?0°/.test(document.getElementById('knob-numbers').textContent));
      await page.waitForFunction(() => !document.getElementById('knob-arm').disabled && globalThis.chalumeau.knob.knob.strayDeg === null);
      for (let time = 0; time < 2; time += 1) {
        await page.evaluate(() => document.getElementById('knob-arm').click());
        await page.waitForTimeout(700);
      }
      assert.ok(!typesOf(await page.evaluate(() => globalThis.serialPort.written)).includes(ARM), 'a program has armed the knob');
      assert.ok(knob.states.length > 50 && knob.states.every(isFree), 'torque without an act of the user');
      assert.deepEqual(errors, []);
    } finally {
      await context.close();
      await knob.end();
    }
  },

  async 'what ends torque is written at once'(browser) {
    const { page, context, errors } = await open(browser, server.address, { before: serialPort(undefined, GOLDEN_SESSION), serviceWorkers: 'block' });
    await page.click('#knob');
    await page.waitForFunction(() => globalThis.chalumeau.knob.knob.farewell);
    // What the audio thread sends comes later, as a message of its own.
    const writtenAt = async (act) => typesOf(await page.evaluate(async (act) => {
      const { written } = globalThis.serialPort;
      const before = written.length;
      new Function(act)();
      for (let turn = 0; turn < 50; turn += 1) await undefined;
      return written.slice(before);
    }, act));
    const hide = (hidden) => `Object.defineProperty(document, 'hidden', { value: ${hidden}, configurable: true }); document.dispatchEvent(new Event('visibilitychange'))`;
    assert.deepEqual(await writtenAt("document.getElementById('knob-stop').click()"), [FREE], 'Stop');
    assert.deepEqual(await writtenAt("document.getElementById('knob-stop').dispatchEvent(new Event('pointerdown'))"), [FREE], 'Stop, pressed');
    assert.deepEqual(await writtenAt("globalThis.chalumeau.knob.knob.isWanted = true; dispatchEvent(new KeyboardEvent('keydown', { code: 'Escape' }))"), [FREE], 'Escape');
    assert.deepEqual(await writtenAt(hide(true)), [FREE], 'hidden');
    assert.deepEqual(await writtenAt(hide(false)), [], 'shown again');
    for (const leave of ['pagehide', 'beforeunload']) assert.deepEqual(await writtenAt(`dispatchEvent(new Event('${leave}'))`), [FREE, BYE], leave);
    assert.deepEqual(errors, []);
    await context.close();
  },

  async 'a damaged byte does not lose the knob'(browser) {
    const { page, context, errors } = await open(browser, server.address, { before: serialPort(), serviceWorkers: 'block' });
    await page.click('#knob');
    await page.waitForFunction(() => globalThis.serialPort.written.length > 0);
    const bytes = () => page.evaluate(() => new Promise((heard) => {
      const { send } = globalThis.chalumeau.knob.knob;
      globalThis.chalumeau.knob.knob.send = (message) => {
        if (message.knobBytes) heard([...message.knobBytes]);
        send(message);
      };
      globalThis.serialPort.feed([1, 2, 3]);
    }));
    for (let time = 0; time < 3; time += 1) {
      await page.evaluate(() => globalThis.serialPort.disturb());
      assert.deepEqual(await bytes(), [1, 2, 3]);
    }
    assert.equal(await page.isVisible('#knob-panel'), true);
    assert.deepEqual(errors, []);
    await context.close();
  },

  async 'a knob that is unplugged is said to be'(browser) {
    const { page, context, errors } = await open(browser, server.address, { before: serialPort(), serviceWorkers: 'block' });
    await page.click('#knob');
    await page.waitForFunction(() => globalThis.serialPort.written.length > 0);
    assert.equal(await page.isVisible('#knob-panel'), true);
    await page.evaluate(() => globalThis.serialPort.unplug());
    await page.waitForFunction(() => document.getElementById('hint').textContent.includes('unplugged'));
    assert.equal(await page.isVisible('#knob-panel'), false);
    // It was closed, so that it can be opened again.
    const opened = await page.evaluate(() => globalThis.serialPort.speeds.length);
    await page.click('#knob');
    await page.waitForFunction((opened) => globalThis.serialPort.speeds.length > opened, opened);
    assert.equal(await page.isVisible('#knob-panel'), true);
    assert.deepEqual(errors, []);
    await context.close();
  },

  'a dragged hole is heard as the native code plays it, and goes back': (browser) => dragHole(browser, false),

  async 'playing keys play after a choice and a number, and a number without room is refused'(browser) {
    const { page, context, errors } = await open(browser, server.address, { serviceWorkers: 'block' });
    const plays = async () => {
      await page.keyboard.down('d');
      await until(page, SOUNDING, 64, 65);
      await until(page, LEVEL, HEARD);
      await page.keyboard.up('d');
      await silence(page);
    };
    await page.click('#holes');
    const middle = await page.$$eval('#hole option', (all) => all.findIndex(({ text }) => text === 'left middle finger hole'));
    assert.ok(middle > 0, 'holes have names');
    await page.selectOption('#hole', String(middle));
    await plays();
    const before = await page.inputValue('#hole-place');
    // A number that is refused gives the keys back, too.
    for (const [field, number] of [['place', '9999'], ['place', ''], ['place', '-5'], ['width', '100']]) {
      const inForce = await page.inputValue(`#hole-${field}`);
      await page.fill(`#hole-${field}`, number);
      await page.press(`#hole-${field}`, 'Enter');
      assert.match(await page.textContent('#hole-state'), new RegExp(`^The ${field} must lie between [0-9.]+ and [0-9.]+ mm.$`));
      assert.equal(await page.inputValue(`#hole-${field}`), inForce);
    }
    await plays();
    await page.fill('#hole-place', (Number(before) - 1).toFixed(1));
    await page.press('#hole-place', 'Enter');
    await page.click('#hole-undo');
    assert.equal(await page.inputValue('#hole-place'), before);
    assert.equal(await page.textContent('#hole-state'), 'As built');
    assert.deepEqual(errors, []);
    await context.close();
  },

  async 'what is held is let go when the page is left or hidden'(browser) {
    const { page, context, errors } = await open(browser, server.address, { serviceWorkers: 'block' });
    const hidden = "Object.defineProperty(document, 'hidden', { value: true, configurable: true }); document.dispatchEvent(new Event('visibilitychange')); delete document.hidden";
    for (const leave of ["dispatchEvent(new Event('blur'))", "dispatchEvent(new Event('pagehide'))", hidden]) {
      for (const part of ['#clarinet', '#keyboard']) {
        const box = await page.locator(part).boundingBox();
        await page.mouse.move(box.x + 0.4 * box.width, box.y + 0.8 * box.height);
        await page.mouse.down();
        await until(page, LEVEL, HEARD);
        await page.evaluate(leave);
        await silence(page);
        await page.mouse.up();
      }
      await page.keyboard.down('d');
      await until(page, LEVEL, HEARD);
      await page.evaluate(leave);
      await silence(page);
      await page.keyboard.up('d');
    }
    assert.deepEqual(errors, []);
    await context.close();
  },

  async 'a visit finds what the last one left, and broken contents count for nothing'(browser) {
    const { page, context, errors } = await open(browser, server.address, { serviceWorkers: 'block' });
    const tags = () => page.textContent('#tags');
    const again = async () => {
      await page.reload();
      await page.waitForFunction(() => globalThis.chalumeau?.engine.node);
    };
    await page.click('#next');
    const name = await page.textContent('#preset');
    assert.doesNotMatch(await tags(), /changed/);
    await page.selectOption('#instrument', '1');
    assert.match(await tags(), /^changed/);
    await page.fill('#volume', '35');
    await page.click('#holes');
    const place = (Number(await page.inputValue('#hole-place')) - 0.5).toFixed(1);
    await page.fill('#hole-place', place);
    await page.press('#hole-place', 'Enter');
    await again();
    assert.equal(await page.textContent('#preset'), name);
    assert.match(await tags(), /^changed/);
    assert.equal(await page.inputValue('#instrument'), '1');
    assert.equal(await page.inputValue('#volume'), '35');
    await page.click('#holes');
    assert.equal(await page.inputValue('#hole-place'), place);
    const old = ['{', 'null', '[]', '7', '{"preset":3,"instrument":"none","moved":[{"name":"L1"}],"controls":{"lip":"x"},"volume":1e9}'];
    for (const broken of old) {
      await page.evaluate((broken) => localStorage.setItem(Object.keys(localStorage)[0], broken), broken);
      await again();
      assert.equal(await page.textContent('#preset'), 'B flat clarinet');
      assert.equal(await page.inputValue('#volume'), '80');
    }
    assert.deepEqual(errors, []);
    await context.close();
  },

  async 'every preset plays'(browser) {
    const { page, context, errors } = await open(browser, server.address, { serviceWorkers: 'block' });
    await page.keyboard.press('Escape');
    await page.click('#browse');
    await page.fill('#search', 'deep nothing');
    assert.equal(await page.locator('#list button').count(), 0);
    await page.fill('#search', 'bass section');
    await page.keyboard.press('Enter');
    assert.equal(await page.textContent('#preset'), 'Bass in the section');
    assert.match(await page.locator('#instrument option:checked').textContent(), /bass/);
    const count = await page.evaluate(async () => (await (await fetch('data.json')).json()).presets.length);
    for (let n = 0; n < count; n += 1) {
      await page.click('#next');
      const name = await page.textContent('#preset');
      await page.evaluate(() => (globalThis.told.length = 0));
      await page.keyboard.down('g');
      await until(page, LEVEL, 0.002).catch(() => assert.fail(`${name} is silent`));
      await page.keyboard.up('g');
      await page.keyboard.press('Escape');
    }
    assert.equal(await page.locator('.hint.failed').count(), 0);
    assert.deepEqual(errors, []);
    await context.close();
    return `${count} presets`;
  },

  async 'the listening page plays what the module makes'(browser) {
    const { page, context, errors } = await open(browser, `${server.address}listen.html`, { other: true, serviceWorkers: 'block' });
    await page.waitForFunction(() => globalThis.listen);
    const cards = page.locator('.stop-card');
    assert.ok((await cards.count()) > 20);
    const began = Date.now();
    await cards.first().click();
    await page.waitForFunction(() => globalThis.listen.playing());
    const took = Date.now() - began;
    await page.screenshot({ path: join(own, 'listen.png') });
    await cards.nth(1).click();
    await page.waitForFunction((before) => globalThis.listen.playing() && globalThis.listen.playing() !== before, await cards.first().locator('b').textContent());
    await cards.nth(1).click();
    assert.equal(await page.evaluate(() => globalThis.listen.playing()), undefined);
    // pp is softer than ff by what the page says, and the church rings on.
    const levels = await page.evaluate(async () => {
      const { tour, made } = globalThis.listen;
      const stops = tour.chapters.flatMap(({ stops }) => stops);
      const find = (title) => stops.find((stop) => stop.title === title);
      const db = (samples) => 10 * Math.log10(samples.reduce((sum, x) => sum + x * x, 1e-12) / samples.length);
      const sounds = await Promise.all(['Scale, pp', 'Scale, ff', 'A church', 'Dry'].map((title) => made(find(title))));
      const [pp, ff] = sounds.map((sound) => db(sound.getChannelData(0)));
      const [church, dry] = sounds.slice(2).map((sound) => db(sound.getChannelData(1).slice(-12000)));
      return { pp, ff, church, dry };
    });
    assert.ok(levels.ff - levels.pp > 15 && levels.church > levels.dry + 20, JSON.stringify(levels));
    assert.deepEqual(errors, []);
    await context.close();
    return `first sound after ${took} ms`;
  },

  async 'on a telephone the listening page draws the first sound, too'(browser) {
    const { page, context, errors } = await open(browser, `${server.address}listen.html`, { other: true, serviceWorkers: 'block', viewport: { width: 390, height: 844 } });
    await page.waitForFunction(() => globalThis.listen);
    await page.locator('.stop-card').first().click();
    await page.waitForFunction(() => globalThis.listen.playing());
    const [width, height] = await page.locator('.stop-card canvas').first().evaluate((canvas) => [canvas.width, canvas.height]);
    assert.ok(width > 200 && height > 20, `${width} x ${height}`);
    assert.deepEqual(errors, []);
    await context.close();
  },

  async 'controls work without a mouse'(browser) {
    const { page, context, errors } = await open(browser, server.address, { serviceWorkers: 'block' });
    const unnamed = await page.$$eval('button, select, input, [tabindex]', (all) =>
      all.filter((element) => !(element.getAttribute('aria-label') || element.textContent.trim() || element.labels?.[0]?.textContent.trim())).map((element) => element.outerHTML),
    );
    assert.deepEqual(unnamed, []);
    const growl = page.locator('#control-growl');
    await growl.focus();
    // The browser's own.
    await page.keyboard.press('Alt+ArrowUp');
    await page.keyboard.press('Control+Home');
    assert.equal(Number(await growl.getAttribute('aria-valuenow')), 0);
    await page.keyboard.press('End');
    assert.equal(Number(await growl.getAttribute('aria-valuenow')), 1);
    assert.equal(await growl.getAttribute('aria-valuetext'), '100 %');
    await page.keyboard.press('Delete');
    assert.equal(Number(await growl.getAttribute('aria-valuenow')), 0);
    // A key plays while a control has the focus.
    await page.keyboard.down('d');
    await until(page, LEVEL, HEARD);
    await page.keyboard.up('d');
    assert.deepEqual(errors, []);
    await context.close();
  },

  async 'the page opens without a network'(browser) {
    const { page, context, errors } = await open(browser, server.address);
    await page.evaluate(() => navigator.serviceWorker.ready);
    await page.waitForFunction(async () => (await caches.keys()).some((name) => name.startsWith('chalumeau')) && navigator.serviceWorker.controller);
    // What is still on its way would fail, which the browser notes as an error.
    await page.waitForLoadState('networkidle');
    await context.setOffline(true);
    await page.reload();
    await page.waitForFunction(() => globalThis.chalumeau?.engine.node);
    await page.keyboard.down('d');
    await until(page, LEVEL, HEARD);
    assert.deepEqual(errors, []);
    await context.close();
  },

  async 'blocks are made in time'(browser) {
    const { page, context } = await open(browser, server.address, { serviceWorkers: 'block' });
    for (const key of 'asdfghjk') {
      await page.keyboard.down(key);
      await page.waitForTimeout(500);
      await page.keyboard.up(key);
    }
    const times = await page.evaluate(
      () =>
        new Promise((done) => {
          addEventListener('chalumeau', ({ detail }) => detail.times && done(detail.times));
          globalThis.chalumeau.engine.send({ times: true });
        }),
    );
    // A bound on a shared machine says little; this one tells a module without optimisation.
    assert.ok(times.mean < 0.5 * times.deadline, JSON.stringify(times));
    await context.close();
    return `${times.blocks} blocks of ${times.deadline.toFixed(2)} ms: mean ${times.mean.toFixed(2)}, p99 ${times.p99.toFixed(1)}, worst ${times.worst.toFixed(1)} ms`;
  },

  async 'pictures in both themes'(browser) {
    for (const [name, [width, height]] of Object.entries(SIZES)) {
      for (const colorScheme of ['dark', 'light']) {
        const { page, context, errors } = await open(browser, server.address, { viewport: { width, height }, colorScheme, serviceWorkers: 'block' });
        await page.keyboard.down('d');
        await until(page, LEVEL, HEARD);
        await page.waitForTimeout(700);
        await page.screenshot({ path: join(own, `${name}-${colorScheme}.png`) });
        const cut = await page.evaluate(() => document.documentElement.scrollWidth > innerWidth || document.documentElement.scrollHeight > innerHeight);
        assert.equal(cut, false, `${name}: the page is larger than the window`);
        assert.deepEqual(errors, []);
        await context.close();
      }
    }
    return own;
  },
};

/** Run only by their names: real time, or minutes of work, on a machine that does nothing else. */
const TIMED = {
  'timed: a hole is heard fitted, as the native code plays it': (browser) => dragHole(browser, true),

  async 'timed: a simulated knob is armed by a click and let go'(browser) {
    const knob = await simulator(PROGRAM, '--hold', '150');
    const { page, context, errors } = await open(browser, server.address, { before: `${serialPort(knob.address)};${SLOW}`, serviceWorkers: 'block' });
    const who = () => page.textContent('#knob-who');
    const isFree = (state) => !state.armed && state.torque === 0;
    try {
      await page.click('#knob');
      await page.waitForFunction(() => /TorqueTuner/.test(document.getElementById('knob-who').textContent), null, { timeout: 20000 });
      await until(page, 8, 5, 6);
      const arm = async () => {
        // On a busy machine a permission may come too late, or the knob may miss some; a player would press again.
        for (let tries = 0; tries < 20; tries += 1) {
          await page.click('#knob-arm', { timeout: 3000 }).catch(() => {});
          if ((await knob.until((state) => state.armed && state.torque > 5, performance.now(), 1500)) < Infinity) return;
        }
        assert.fail(`the knob does not arm: ${await who()}`);
      };
      const times = [];
      const lets = async (name, act, told) => {
        await arm();
        const began = performance.now();
        await act();
        const took = await knob.until(isFree, began);
        assert.ok(took < FREE_MS, `${name}: ${took} ms`);
        if (told) await page.waitForFunction((told) => document.getElementById('knob-who').textContent.includes(told), told);
        const after = performance.now();
        await page.waitForTimeout(250);
        assert.ok(knob.states.filter(({ at }) => at > after).every(isFree), `${name}: it stays free`);
        times.push(`${name} ${took.toFixed(0)}`);
      };
      const button = await page.locator('#knob-stop').boundingBox();
      await lets('Stop', () => page.mouse.click(button.x + 20, button.y + 20), 'stop was pressed');
      await lets('Escape', () => page.keyboard.press('Escape'), 'stop was pressed');
      // Before the page has heard that the knob is armed: the button with the focus must not be pressed again.
      await page.waitForFunction(() => !document.getElementById('knob-arm').disabled);
      await page.click('#knob-arm');
      await page.waitForTimeout(50);
      await page.keyboard.press('Space');
      const spaced = performance.now();
      await page.waitForTimeout(1500);
      assert.ok(knob.states.filter(({ at }) => at > spaced + FREE_MS).every(isFree), 'the space bar stops an arming knob');
      const hide = (hidden) => page.evaluate((hidden) => {
        Object.defineProperty(document, 'hidden', { value: hidden, configurable: true });
        document.dispatchEvent(new Event('visibilitychange'));
      }, hidden);
      await lets('hidden', () => hide(true), 'the page was hidden');
      await hide(false);
      await lets('no heartbeat', () => page.evaluate(() => clearInterval(globalThis.chalumeau.knob.knob.beating)), 'the page has stood still');
      await page.evaluate(() => {
        const { knob } = globalThis.chalumeau.knob;
        knob.beating = setInterval(() => knob.beat(), 100);
      });
      await lets('page hangs', () => page.evaluate(() => void setTimeout(() => {
        for (const until = performance.now() + 900; performance.now() < until; );
      }, 0)));
      await lets('sound stops', () => page.evaluate(() => globalThis.chalumeau.engine.context.suspend()));
      await page.evaluate(() => globalThis.chalumeau.engine.context.resume());
      await lets('reload', () => page.evaluate(() => location.assign('about:blank')).catch(() => {}));
      assert.deepEqual(errors, []);
      return `ms until no torque: ${times.join(', ')}`;
    } finally {
      await context.close();
      await knob.end();
    }
  },
};

/** Levels while the microphone hears a file, in parts of its time, s. */
async function microphone(samples, parts) {
  const path = join(own, 'microphone.wav');
  writeWav(path, samples);
  const browser = await launch(own, path);
  try {
    const { page, errors } = await open(browser, server.address, { serviceWorkers: 'block' });
    await page.click('#microphone');
    await page.waitForFunction(() => globalThis.told.at(-1)?.microphone);
    // The file begins as the device is opened; the first picture with a microphone comes just after.
    const began = await page.evaluate(() => globalThis.told.find((said) => said.microphone).at);
    await page.waitForTimeout(1000 * (samples.length / 48000 + 0.5));
    const said = (await pictures(page)).map(({ at, picture }) => [(at - began) / 1000, picture[LEVEL]]);
    assert.deepEqual(errors, []);
    return parts.map(([from, to]) => Math.max(...said.filter(([at]) => at >= from && at < to).map(([, level]) => level)));
  } finally {
    await browser.close();
  }
}

const MICROPHONE = {
  async 'a blow at the microphone plays, and stops'() {
    const samples = sequence(room(QUIET_S), blow(1.5), room(1.5), blow(1, { corner: 400 }), room(1));
    const [before, first, between, second] = await microphone(samples, [[0.5, QUIET_S - 0.3], [QUIET_S + 0.4, QUIET_S + 1.2], [QUIET_S + 2.4, QUIET_S + 2.7], [QUIET_S + 3.4, QUIET_S + 3.8]]);
    assert.ok(before < SILENT && between < SILENT, `silent: ${before}, ${between}`);
    assert.ok(first > HEARD && second > HEARD, `heard: ${first}, ${second}`);
  },

  async 'speech at the microphone does not play'() {
    const said = sequence(room(QUIET_S), speech(SENTENCES[0], 'en-us', own), speech(SENTENCES[1], 'en-gb+f3', own));
    const [most] = await microphone(said, [[0.5, said.length / 48000]]);
    assert.ok(most < SILENT, `${most}`);
  },
};

const tests = running(process.argv[4]);
await tests.run(() => launch(own), TESTS);
if (process.argv[4]?.startsWith('timed')) await tests.run(() => launch(own), TIMED);
// Each has a browser of its own, which hears its file.
await tests.run(() => {}, MICROPHONE);
server.close();
tests.end();
