// What users do to the page, and what happens to it, in Chromium: node use.mjs PAGE FOLDER.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { workshopOf } from './module.mjs';
import { DYNAMIC, HEARD, KEY, LEVEL, PLAIN_HOST, SOUNDING, latest, launch, open, running, serve, silence, until } from './page.mjs';

const [folder, own] = process.argv.slice(2);
const server = await serve(folder);
const PLAIN = { serviceWorkers: 'block' };

/** Waits for what the page says below the clarinet, or elsewhere. */
const says = (page, words, id = 'hint') =>
  page.waitForFunction(([words, id]) => new RegExp(words).test(document.getElementById(id).textContent), [String(words).slice(1, -1), id]);
const hint = (page) => page.textContent('#hint');
const held = (page) => page.evaluate(() => globalThis.chalumeau.hands.held.size);
const moved = (page) => page.evaluate(() => Object.fromEntries(globalThis.chalumeau.holes.moved.map(({ name, x_m, radius_m }) => [name, [x_m, radius_m]])));
/** A file is not found, and the browser notes it. */
const isLoss = (error) => /404|Failed to load/.test(error);

/** A page with one MIDI device, `globalThis.device`, that the test plays by `wind`. */
function withDevice() {
  const input = { id: '1', name: 'Wind controller', state: 'connected' };
  const inputs = new Map([['1', input]]);
  const access = { inputs };
  globalThis.wind = (...bytes) => input.onmidimessage({ data: new Uint8Array(bytes) });
  globalThis.unplug = () => {
    inputs.clear();
    access.onstatechange();
  };
  navigator.requestMIDIAccess = async () => access;
}

async function openWithDevice(browser, options) {
  const opened = await open(browser, server.address, { before: withDevice, ...PLAIN, ...options });
  await opened.page.click('#midi');
  return { ...opened, wind: (...bytes) => opened.page.evaluate((bytes) => globalThis.wind(...bytes), bytes) };
}

/** Ends a test whose page may have no errors. */
async function end({ context, errors }) {
  assert.deepEqual(errors, []);
  await context.close();
}

/** Chooses a hole by its name in the file. */
async function chooseHole(page, name) {
  await page.selectOption('#hole', String(await page.evaluate((name) => globalThis.chalumeau.holes.holes.findIndex((hole) => hole.name === name), name)));
}

async function enter(page, field, number) {
  await page.fill(`#hole-${field}`, String(number));
  await page.press(`#hole-${field}`, 'Enter');
}

/** Middle of a hole in the window, once the stage has its size. */
async function placeOf(page, name) {
  const seen = () => page.evaluate((name) => {
    const box = document.getElementById('clarinet').getBoundingClientRect();
    const { drawing, holes } = globalThis.chalumeau.holes;
    const [x, y] = drawing.place(holes.find((hole) => hole.name === name));
    return [box.left + x, box.top + y];
  }, name);
  for (let before; ; ) {
    const now = await seen();
    if (String(now) === String(before)) return now;
    before = now;
    await page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
  }
}

const SILENCE = {
  async 'a browser that is too old, or gives no sound, is said to'(browser) {
    const cases = [
      ['delete globalThis.AudioContext', /^No sound: this browser is too old/],
      ["globalThis.AudioContext = class { constructor() { throw new Error('no device') } }", /^No sound: the browser gives no sound .no device.\.$/],
    ];
    for (const [before, words] of cases) {
      const opened = await open(browser, server.address, { before, early: true, ...PLAIN });
      await says(opened.page, words);
      assert.equal(await opened.page.locator('.hint.failed').count(), 1);
      // Nothing else breaks.
      await opened.page.keyboard.press('d');
      await opened.page.click('#next');
      await end(opened);
    }
  },

  async 'an address that is not secure is said to need https, and has no buttons that cannot work'(browser) {
    const address = server.address.replace('localhost', PLAIN_HOST);
    const opened = await open(browser, address, { early: true, ...PLAIN });
    await says(opened.page, /^No sound: a browser plays this page from https or from localhost only/);
    for (const id of ['microphone', 'midi']) assert.equal(await opened.page.isVisible(`#${id}`), false, id);
    assert.equal(await opened.page.isVisible('#knob'), true);
    await opened.page.goto(`${address}listen.html`);
    await says(opened.page, /^No sound: a browser plays this page from https or from localhost only/, 'trouble');
    await end(opened);
  },

  async 'MIDI that is not allowed is told from MIDI that does not work'(browser) {
    const cases = [['NotAllowedError', /MIDI is blocked/], ['SecurityError', /MIDI is blocked/], ['InvalidStateError', /^No MIDI: no driver/]];
    for (const [name, words] of cases) {
      const before = `navigator.requestMIDIAccess = async () => { throw new DOMException('no driver', '${name}') }`;
      const opened = await open(browser, server.address, { before, ...PLAIN });
      await opened.page.click('#midi');
      await says(opened.page, words);
      await end(opened);
    }
  },

  async 'a file that is lost on the way is not taken for a page without a server'(browser) {
    for (const [address, name, id] of [['', 'meter.js', 'hint'], ['listen.html', 'sound.js', 'trouble']]) {
      server.instead.set(name, null);
      const { page, context, errors } = await open(browser, `${server.address}${address}`, { other: true, ...PLAIN });
      await says(page, /^A part of the page could not be loaded/, id);
      server.instead.delete(name);
      assert.deepEqual(errors.filter((error) => !isLoss(error)), []);
      await context.close();
    }
  },

  async 'while the sound is on its way the page says that it loads'(browser) {
    let letGo;
    const gate = new Promise((open) => (letGo = open));
    server.instead.set('chalumeau.wasm', () => gate);
    const opened = await open(browser, server.address, { early: true, ...PLAIN });
    const { page } = opened;
    assert.equal(await hint(page), 'Loading …');
    await page.keyboard.down('d');
    assert.equal(await hint(page), 'Loading …');
    server.instead.delete('chalumeau.wasm');
    letGo();
    await until(page, LEVEL, HEARD);
    assert.equal(await hint(page), '');
    await end(opened);
  },

  async 'sound that could not be prepared is said, and nobody waits for it'(browser) {
    server.instead.set('chalumeau.wasm', null);
    const { page, context, errors } = await open(browser, server.address, { early: true, ...PLAIN });
    await says(page, /^No sound: chalumeau.wasm could not be loaded/);
    server.instead.delete('chalumeau.wasm');
    const told = await page.evaluate(() => globalThis.chalumeau.engine.prepared.then(() => 'prepared', ({ message }) => message));
    assert.match(told, /could not be loaded/);
    await page.click('#microphone');
    assert.equal(await page.getAttribute('#microphone', 'aria-pressed'), 'false');
    assert.deepEqual(errors.filter((error) => !isLoss(error)), []);
    await context.close();
  },

  async 'on a telephone the page says that it records before it asks for the microphone'(browser) {
    const before = () => {
      const session = { type: 'auto' };
      Object.defineProperty(navigator, 'audioSession', { value: session });
      globalThis.asked = [];
      // As WebKit does; then there is none.
      navigator.mediaDevices.getUserMedia = async () => {
        globalThis.asked.push(session.type);
        throw session.type === 'playback' ? new DOMException('AudioSession category is not compatible with audio capture.', 'InvalidStateError') : new DOMException('', 'NotFoundError');
      };
    };
    const opened = await open(browser, server.address, { before, ...PLAIN });
    const { page } = opened;
    await page.click('#microphone');
    await says(page, /^No microphone was found/);
    assert.deepEqual(await page.evaluate(() => [globalThis.asked, navigator.audioSession.type]), [['play-and-record'], 'playback']);
    await end(opened);
  },

  async 'who still blows goes on when another hand lets go'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    await page.evaluate(() => {
      const { engine } = globalThis.chalumeau;
      const send = engine.send.bind(engine);
      globalThis.breaths = [];
      engine.send = (message) => {
        if ('breath' in message) globalThis.breaths.push(message.breath);
        send(message);
      };
    });
    const blown = () => page.evaluate(() => globalThis.breaths.at(-1));
    const box = await page.locator('#clarinet').boundingBox();
    await page.mouse.move(box.x + 0.5 * box.width, box.y + 0.5 * box.height);
    await page.mouse.down();
    const own = await blown();
    assert.ok(own > 0.2 && own < 0.8, `${own}`);
    await page.keyboard.down('d');
    await page.keyboard.press('ArrowUp');
    assert.notEqual(await blown(), own);
    await page.keyboard.up('d');
    assert.equal(await blown(), own);
    await page.mouse.up();
    assert.equal(await blown(), null);
    await end(opened);
  },

  async 'a preset that nobody has changed is kept by its name alone'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    const kept = () => page.evaluate(() => {
      const [key] = Object.keys(localStorage);
      return JSON.parse(localStorage.getItem(key));
    });
    const growl = page.locator('#control-growl');
    await growl.focus();
    await page.keyboard.press('End');
    assert.equal((await kept()).controls.growl, 1);
    await page.keyboard.press('Delete');
    assert.deepEqual(Object.keys(await kept()).sort(), ['preset', 'volume']);
    await end(opened);
  },

  async 'a failure that has passed is not said any more'(browser) {
    const before = () => {
      globalThis.isBusy = true;
      const { resume } = AudioContext.prototype;
      AudioContext.prototype.resume = function () {
        return globalThis.isBusy ? Promise.reject(new Error('the device is busy')) : resume.call(this);
      };
      // The browser lets nothing sound by itself.
      const Own = AudioContext;
      globalThis.AudioContext = class extends Own {
        constructor(options) {
          super(options);
          this.suspend();
        }
      };
    };
    const opened = await open(browser, server.address, { before, ...PLAIN });
    const { page } = opened;
    await page.keyboard.press('d');
    await says(page, /^No sound: the device is busy/);
    await page.evaluate(() => (globalThis.isBusy = false));
    await page.keyboard.down('d');
    await until(page, LEVEL, HEARD);
    assert.equal(await page.locator('.hint.failed').count(), 0);
    assert.doesNotMatch(await hint(page), /No sound/);
    await end(opened);
  },

  async 'MIDI before any click says that a click is wanted'(browser) {
    const before = `(${withDevice})(); ${(() => {
      const userActivation = { hasBeenActive: false };
      Object.defineProperty(navigator, 'userActivation', { value: userActivation });
      addEventListener('pointerdown', () => (userActivation.hasBeenActive = true), { capture: true });
      const Own = AudioContext;
      const { resume } = Own.prototype;
      globalThis.AudioContext = class extends Own {
        constructor(options) {
          super(options);
          super.suspend();
        }

        // Without a gesture it waits, as browsers do. (The driver's scripts count as gestures.)
        resume() {
          return navigator.userActivation.hasBeenActive ? resume.call(this) : new Promise(() => {});
        }
      };
    }).toString().replace(/^/, '(')})()`;
    const opened = await open(browser, server.address, { before, permissions: ['midi'], ...PLAIN });
    const { page } = opened;
    await page.waitForFunction(() => document.getElementById('midi').getAttribute('aria-pressed') === 'true');
    await page.evaluate(() => globalThis.wind(0x90, 60, 100));
    await says(page, /^MIDI: Wind controller/);
    await says(page, /^Click once to switch the sound on/);
    await page.mouse.click(20, 20);
    await until(page, LEVEL, HEARD);
    await page.waitForFunction(() => !/Click once/.test(document.getElementById('hint').textContent));
    await end(opened);
  },
};

const MIDI = {
  async 'a device that is unplugged leaves neither a note nor its breath'(browser) {
    const opened = await openWithDevice(browser);
    const { page, wind } = opened;
    await wind(0xb3, 64, 127);
    await wind(0x93, 60, 100);
    await until(page, LEVEL, HEARD);
    await wind(0x83, 60, 0);
    await until(page, KEY, 60, 61);
    await page.evaluate(() => globalThis.unplug());
    await silence(page);
    await end(opened);
  },

  async 'where nobody blows the wind controller the computer plays'(browser) {
    const opened = await openWithDevice(browser);
    const { page, wind } = opened;
    const plays = async () => {
      await page.keyboard.down('d');
      await until(page, LEVEL, HEARD);
      await page.keyboard.up('d');
      await silence(page);
    };
    for (const breath of [0, 40, 80]) await wind(0xb0, 2, breath);
    await wind(0x90, 60, 100);
    await until(page, LEVEL, HEARD);
    await wind(0x80, 60, 0);
    await wind(0xb0, 2, 0);
    await silence(page);
    await says(page, /^Breath: CC2$/, 'breathing');
    await plays();
    await says(page, /^Breath: keys$/, 'breathing');
    // A note of the controller has its own breath again: none, and then some.
    await wind(0x90, 62, 100);
    await until(page, KEY, 62, 63);
    await page.evaluate(() => (globalThis.told.length = 0));
    await page.waitForFunction(() => globalThis.told.length > 12);
    const most = await page.evaluate((level) => Math.max(...globalThis.told.map(({ picture }) => picture[level])), LEVEL);
    assert.ok(most < HEARD, `${most}`);
    await wind(0xb0, 2, 80);
    await until(page, LEVEL, HEARD);
    // Unplugged as it is blown: the keys have the breath, and nothing is found any more.
    await page.evaluate(() => globalThis.unplug());
    await silence(page);
    await says(page, /^Breath: keys$/, 'breathing');
    await plays();
    await end(opened);
  },

  async 'MIDI that is asked for twice plays each note once, and is switched off whole'(browser) {
    const before = () => {
      // Each request has its own inputs, as the standard says, and takes its time.
      const devices = [];
      globalThis.devices = devices;
      globalThis.wind = (...bytes) => devices.forEach((input) => input.onmidimessage?.({ data: new Uint8Array(bytes) }));
      navigator.requestMIDIAccess = async () => {
        await new Promise((later) => setTimeout(later, 200));
        const input = { id: '1', name: 'Wind controller', state: 'connected', onmidimessage: null };
        devices.push(input);
        return { inputs: new Map([['1', input]]) };
      };
      globalThis.sent = [];
    };
    const opened = await open(browser, server.address, { before, ...PLAIN });
    const { page } = opened;
    await page.evaluate(() => {
      const { hands } = globalThis.chalumeau;
      const { send } = hands;
      hands.send = (message) => {
        globalThis.sent.push(message);
        send(message);
      };
    });
    await page.click('#midi');
    await page.click('#midi');
    await page.waitForFunction(() => document.getElementById('midi').getAttribute('aria-pressed') === 'true');
    await page.waitForTimeout(400);
    const strike = () => page.evaluate(() => {
      globalThis.sent.length = 0;
      globalThis.wind(0x90, 60, 100);
      return globalThis.sent.map(({ midi }) => midi);
    });
    assert.deepEqual(await strike(), [[0x90, 60, 100]]);
    await page.evaluate(() => globalThis.wind(0x80, 60, 0));
    await page.click('#midi');
    assert.deepEqual(await strike(), []);
    await page.click('#midi');
    await page.waitForFunction(() => document.getElementById('midi').getAttribute('aria-pressed') === 'true');
    assert.deepEqual(await strike(), [[0x90, 60, 100]]);
    await end(opened);
  },

  async 'a key that is pressed blows its note'(browser) {
    const opened = await openWithDevice(browser);
    const { page, wind } = opened;
    await wind(0x90, 60, 100);
    await until(page, LEVEL, HEARD);
    await wind(0xa0, 60, 10);
    await says(page, /^Breath: the note$/, 'breathing');
    await until(page, DYNAMIC, 0, 0.2);
    await wind(0xa0, 60, 127);
    await until(page, DYNAMIC, 0.9);
    await wind(0x80, 60, 0);
    await silence(page);
    await end(opened);
  },

  async 'CC120 and CC123 let go of what is held'(browser) {
    const opened = await openWithDevice(browser);
    const { page, wind } = opened;
    for (const all of [120, 123]) {
      await wind(0x90, 60, 100);
      await until(page, LEVEL, HEARD);
      assert.equal(await held(page), 1);
      await wind(0xb0, all, 0);
      await silence(page);
      assert.equal(await held(page), 0);
    }
    await end(opened);
  },

  async 'of two pages the one that was looked at last plays MIDI'(browser) {
    const first = await openWithDevice(browser);
    const second = await openWithDevice(browser, { beside: first.context });
    await first.page.waitForFunction(() => true);
    const both = async () => {
      for (const { wind } of [first, second]) await wind(0x90, 60, 100);
      const counts = [await held(first.page), await held(second.page)];
      for (const { wind } of [first, second]) await wind(0x80, 60, 0);
      return counts;
    };
    // A message goes from page to page in its own time.
    const become = async (wanted) => {
      for (let tries = 0; tries < 100; tries += 1) {
        const now = await both();
        if (String(now) === String(wanted)) return;
        await first.page.evaluate(() => new Promise((later) => setTimeout(later, 20)));
      }
      assert.deepEqual(await both(), wanted);
    };
    await become([0, 1]);
    await second.wind(0x90, 62, 100);
    await first.page.bringToFront();
    await first.page.evaluate(() => dispatchEvent(new Event('focus')));
    await second.page.waitForFunction(() => globalThis.chalumeau.hands.held.size === 0);
    await become([1, 0]);
    assert.deepEqual(second.errors, []);
    await end(first);
  },
};

const HOLES = {
  async 'a hole that stays is not moved by one that moves'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    await page.evaluate(() => {
      globalThis.heard = 0;
      addEventListener('moved', () => (globalThis.heard += 1));
    });
    await page.click('#holes');
    await chooseHole(page, 'EB_KEY');
    await enter(page, 'place', 436.4);
    await chooseHole(page, 'F_PAD');
    await enter(page, 'place', 441.4);
    await chooseHole(page, 'EB_KEY');
    const wide = Number(await page.inputValue('#hole-width')) - 1;
    await page.evaluate(() => (globalThis.heard = 0));
    await enter(page, 'width', wide.toFixed(1));
    await page.waitForFunction(() => globalThis.heard > 0);
    const all = await moved(page);
    assert.ok(Math.abs(all.F_PAD[0] - 0.4414) < 1e-6, `F_PAD at ${all.F_PAD[0]} m`);
    assert.ok(Math.abs(all.EB_KEY[0] - 0.4364) < 1e-6 && Math.abs(2e3 * all.EB_KEY[1] - wide) < 0.06);
    await end(opened);
  },

  async 'a preset has its holes where they were built'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    await page.click('#holes');
    await chooseHole(page, 'F_PAD');
    const built = await page.inputValue('#hole-place');
    await enter(page, 'place', 468);
    assert.match(await page.textContent('#tags'), /^changed/);
    // The next preset is of the same instrument.
    const before = await page.inputValue('#instrument');
    await page.click('#next');
    assert.equal(await page.inputValue('#instrument'), before);
    assert.equal(await page.inputValue('#hole-place'), built);
    assert.deepEqual(await moved(page), {});
    assert.doesNotMatch(await page.textContent('#tags'), /changed/);
    await page.click('#hole-undo');
    assert.equal(await page.inputValue('#hole-place'), '468.0');
    assert.match(await page.textContent('#tags'), /^changed/);
    await end(opened);
  },

  async 'notes that begin while another instrument comes in are played once, and end'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    await page.keyboard.down('d');
    await until(page, LEVEL, HEARD);
    for (const off of [[60, 62], [62, 60]]) {
      await page.evaluate((off) => {
        const { engine } = globalThis.chalumeau;
        engine.send({ midi: [0x90, 60, 100] });
        engine.send({ instrument: 1 });
        engine.send({ midi: [0x90, 62, 100] });
        engine.send({ breath: 0.9 });
        off.forEach((note) => engine.send({ midi: [0x80, note, 0] }));
      }, off);
      await page.keyboard.up('d');
      await silence(page);
      await page.keyboard.down('d');
      await until(page, LEVEL, HEARD);
    }
    await page.keyboard.up('d');
    await silence(page);
    await end(opened);
  },

  async 'the panel shows a hole of the instrument that is chosen, and moves it'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    await page.click('#holes');
    const before = await page.inputValue('#hole-place');
    await page.selectOption('#instrument', '4');
    const place = await page.inputValue('#hole-place');
    assert.notEqual(place, before);
    const shown = await page.evaluate(() => {
      const { holes } = globalThis.chalumeau;
      return [holes.chosen, Number(document.getElementById('hole').value), (1e3 * holes.holes[holes.chosen].x).toFixed(1)];
    });
    assert.deepEqual(shown, [shown[1], shown[1], place]);
    await enter(page, 'place', Number(place) + 1);
    assert.equal(Object.keys(await moved(page)).length, 1);
    await end(opened);
  },

  async 'what is back as the preset has it has not changed'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    const isChanged = async () => /^changed/.test(await page.textContent('#tags'));
    await page.click('#holes');
    await chooseHole(page, 'F_PAD');
    await enter(page, 'place', 468);
    assert.equal(await isChanged(), true);
    await page.click('#hole-back');
    assert.equal(await isChanged(), false);
    const built = await page.inputValue('#hole-place');
    for (const place of [468, built]) await enter(page, 'place', place);
    assert.equal(await isChanged(), false);
    await page.focus('#control-noise');
    await page.keyboard.press('ArrowUp');
    assert.equal(await isChanged(), true);
    await page.keyboard.press('ArrowDown');
    assert.equal(await isChanged(), false);
    await page.selectOption('#instrument', '1');
    assert.equal(await isChanged(), true);
    await page.selectOption('#instrument', '0');
    assert.equal(await isChanged(), false);
    await page.reload();
    await page.waitForFunction(() => globalThis.chalumeau?.engine.node);
    assert.equal(await isChanged(), false);
    await end(opened);
  },

  async 'a hole is chosen by a touch and moved by a drag'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    await page.click('#holes');
    const [x, y] = await placeOf(page, 'F_PAD');
    const index = await page.evaluate(() => globalThis.chalumeau.holes.holes.findIndex(({ name }) => name === 'F_PAD'));
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + 3, y - 2);
    await page.mouse.up();
    assert.equal(await page.inputValue('#hole'), String(index));
    assert.deepEqual(await moved(page), {});
    assert.equal(await page.isDisabled('#hole-undo'), true);
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x - 12, y, { steps: 4 });
    await page.mouse.up();
    assert.deepEqual(Object.keys(await moved(page)), ['F_PAD']);
    // One drag is one step.
    await page.click('#hole-undo');
    assert.deepEqual(await moved(page), {});
    // Not by the right button.
    await page.mouse.move(...(await placeOf(page, 'F_PAD')));
    await page.mouse.down({ button: 'right' });
    await page.mouse.move(x - 30, y, { steps: 4 });
    await page.mouse.up({ button: 'right' });
    assert.deepEqual(await moved(page), {});
    await end(opened);
  },

  async 'the width of a hole has the limits of the core'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    await page.click('#holes');
    await chooseHole(page, 'F_PAD');
    const built = await page.inputValue('#hole-width');
    for (const width of [0.1, 15.5, 39]) {
      await enter(page, 'width', width);
      // The bore is some 15 mm wide there.
      await says(page, /^The width must lie between 0.2 and 1[45]\.[0-9] mm.$/, 'hole-state');
      assert.equal(await page.inputValue('#hole-width'), built);
    }
    await enter(page, 'width', 0.3);
    assert.ok(Math.abs((await moved(page)).F_PAD[1] - 0.15e-3) < 1e-9);
    // One hole that is damaged in what was kept takes no other along.
    await page.evaluate(() => {
      const [name] = Object.keys(localStorage);
      const kept = JSON.parse(localStorage.getItem(name));
      kept.moved.push({ name: 'EB_KEY', x_m: 0.4, radius_m: 0.5 });
      localStorage.setItem(name, JSON.stringify(kept));
    });
    await page.reload();
    await page.waitForFunction(() => globalThis.chalumeau?.engine.node);
    assert.deepEqual(Object.keys(await moved(page)), ['F_PAD']);
    await end(opened);
  },

  async 'a workshop that was lost on the way is asked for again'(browser) {
    const name = workshopOf(folder);
    server.instead.set(name, null);
    const { page, context, errors } = await open(browser, server.address, PLAIN);
    await page.evaluate(() => {
      globalThis.heard = 0;
      addEventListener('moved', () => (globalThis.heard += 1));
    });
    await page.click('#holes');
    await chooseHole(page, 'F_PAD');
    await enter(page, 'place', 468);
    await says(page, /^A part of the page could not be loaded .the server answers 404/, 'hole-state');
    server.instead.delete(name);
    await enter(page, 'place', 467);
    await page.waitForFunction(() => globalThis.heard > 0);
    assert.deepEqual(errors.filter((error) => !isLoss(error)), []);
    await context.close();
  },

  async 'a file that is dropped is opened, or told what it is not'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    const drop = (name, text) => page.evaluate(([name, text]) => {
      const dataTransfer = new DataTransfer();
      dataTransfer.items.add(new File([text], name));
      const event = new DragEvent('drop', { dataTransfer, cancelable: true, bubbles: true });
      document.getElementById('clarinet').dispatchEvent(event);
      return event.defaultPrevented;
    }, [name, text]);
    assert.equal(await drop('song.mid', 'MThd'), true);
    await says(page, /^song.mid is not opened. A Chalumeau instrument file ends in .toml/, 'hole-state');
    assert.equal(await page.isVisible('#hole-panel'), true);
    await drop('other.toml', '[package]');
    await says(page, /^other.toml is not opened. This is not a Chalumeau instrument file \(.toml\). Line 1 is not understood.$/, 'hole-state');
    assert.match(await page.getAttribute('#hole-state', 'title'), /unknown field/);
    await end(opened);
  },
};

const HANDS = {
  async 'a fingered note stays the written note on another instrument'(browser) {
    const before = () => (navigator.mediaDevices.getUserMedia = async () => new AudioContext().createMediaStreamDestination().stream);
    const opened = await open(browser, server.address, { before, ...PLAIN });
    const { page } = opened;
    await page.click('#microphone');
    await page.keyboard.press('a');
    const fingered = () => page.evaluate(() => globalThis.chalumeau.hands.fingered?.note);
    const written = () => page.textContent('#written');
    assert.equal(await fingered(), 60);
    await until(page, KEY, 60, 61);
    await page.waitForFunction(() => document.getElementById('written').textContent === 'D4');
    const names = await page.$$eval('#instrument option', (all) => all.map(({ text }) => text));
    for (const [at] of names.entries()) {
      await page.selectOption('#instrument', String(at));
      const note = await fingered();
      await until(page, KEY, note, note + 1);
      await page.waitForFunction(() => document.getElementById('written').textContent !== '');
      assert.equal(await written(), 'D4', names[at]);
    }
    // What the other does not have becomes the nearest that speaks.
    await page.selectOption('#instrument', '0');
    await page.evaluate(() => globalThis.chalumeau.hands.finger(30));
    await page.selectOption('#instrument', '1');
    const [note, lowest] = await page.evaluate(() => [globalThis.chalumeau.hands.fingered.note, globalThis.chalumeau.holes.drag.notes[0]]);
    assert.equal(note, lowest);
    await page.keyboard.press('Escape');
    await says(page, /^Choose a note/);
    await page.keyboard.press('a');
    await page.waitForFunction(() => !/^Choose a note/.test(document.getElementById('hint').textContent));
    await end(opened);
  },

  async 'letters begin with the same written note on each instrument, and the arrows are said to blow'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    // On the E flat clarinet the same key is another written note.
    for (const [at, written] of [['0', 'D4'], ['4', 'D4'], ['2', 'A3'], ['0', 'D4']]) {
      await page.selectOption('#instrument', at);
      await page.evaluate(() => {
        document.activeElement.blur();
        document.getElementById('written').textContent = '';
      });
      await page.keyboard.down('a');
      await page.waitForFunction((written) => document.getElementById('written').textContent === written, written);
      await page.keyboard.press('ArrowUp');
      await says(page, /^Breath: arrow keys$/, 'breathing');
      await page.keyboard.up('a');
      await says(page, /^Breath: keys$/, 'breathing');
    }
    await end(opened);
  },

  async 'the first preset that is found has the words in its name'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    for (const [words, name] of [['clarinet in c', 'Clarinet in C'], ['soft pad', 'Keys, soft pad'], ['bass', 'Bass in the section']]) {
      await page.click('#browse');
      await page.fill('#search', words);
      await page.press('#search', 'Enter');
      assert.equal(await page.textContent('#preset'), name, words);
    }
    await end(opened);
  },

  async 'help explains every control, and closes'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    await page.click('#about');
    const [terms, meanings] = await Promise.all(['dt', 'dd'].map((kind) => page.locator(`#help ${kind}`).allTextContents()));
    assert.deepEqual(terms, await page.locator('.knob b').allTextContents());
    assert.ok(meanings.every((meaning) => meaning.length > 30));
    assert.equal((await page.request.get(`${server.address}${await page.getAttribute('#help a[href$=txt]', 'href')}`)).status(), 200);
    // No letter plays while it is read, wherever it was touched.
    await page.keyboard.down('d');
    assert.equal(await held(page), 0);
    await page.keyboard.up('d');
    await page.click('#help dd >> nth=0');
    await page.keyboard.down('d');
    assert.equal(await held(page), 0);
    await page.keyboard.up('d');
    await page.keyboard.press('Escape');
    assert.equal(await page.isVisible('#help'), false);
    await end(opened);
  },

  async 'one key of two hands ends with the last of them'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    await page.keyboard.down('d');
    await until(page, KEY, 64, 65);
    const box = await page.evaluate(() => {
      const key = [...document.querySelectorAll('.key')].find((key) => key.querySelector('kbd')?.textContent === 'D').getBoundingClientRect();
      return [key.left + key.width / 2, key.bottom - 8];
    });
    await page.mouse.move(...box);
    await page.mouse.down();
    await page.mouse.up();
    assert.equal(await held(page), 1);
    await page.evaluate(() => (globalThis.told.length = 0));
    await page.waitForFunction(() => globalThis.told.length > 5);
    assert.equal((await latest(page))[KEY], 64);
    await page.keyboard.up('d');
    await silence(page);
    assert.equal(await held(page), 0);
    await end(opened);
  },

  async 'the right button neither plays nor turns'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    for (const part of ['#clarinet', '#keyboard', '#control-growl']) {
      const box = await page.locator(part).boundingBox();
      await page.mouse.move(box.x + 0.4 * box.width, box.y + 0.8 * box.height);
      await page.mouse.down({ button: 'right' });
      await page.mouse.move(box.x + 0.5 * box.width, box.y + 0.1 * box.height, { steps: 3 });
      assert.equal(await held(page), 0, part);
      await page.mouse.up({ button: 'right' });
    }
    assert.equal(Number(await page.getAttribute('#control-growl', 'aria-valuenow')), 0);
    await end(opened);
  },

  async 'a swipe over the controls of a phone turns none'(browser) {
    const options = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true, ...PLAIN };
    const opened = await open(browser, server.address, options);
    const { page } = opened;
    const session = await opened.context.newCDPSession(page);
    const box = await page.locator('#control-lip').boundingBox();
    const [x, y] = [box.x + 40, box.y + 30];
    const touch = (type, ...points) => session.send('Input.dispatchTouchEvent', { type, touchPoints: points.map(([x, y]) => ({ id: 1, x, y })) });
    const value = () => page.getAttribute('#control-lip', 'aria-valuenow').then(Number);
    const before = await value();
    // Not quite sideways, as a thumb goes.
    await touch('touchStart', [x, y]);
    for (let step = 1; step <= 4; step += 1) await touch('touchMove', [x - 6 * step, y - step]);
    await touch('touchEnd');
    assert.equal(await value(), before);
    // Upwards it turns, and what the browser takes back does not count.
    await touch('touchStart', [x, y]);
    for (let step = 1; step <= 4; step += 1) await touch('touchMove', [x, y - 10 * step]);
    assert.ok((await value()) > before);
    await touch('touchCancel');
    assert.equal(await value(), before);
    await touch('touchStart', [x, y]);
    for (let step = 1; step <= 4; step += 1) await touch('touchMove', [x, y - 10 * step]);
    await touch('touchEnd');
    assert.ok((await value()) > before);
    await end(opened);
  },

  async 'what is used by the mouse gives the keys back, and what is used by keys keeps them'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    const focus = () => page.evaluate(() => document.activeElement.id);
    const growl = await page.locator('#control-growl').boundingBox();
    await page.mouse.move(growl.x + growl.width / 2, growl.y + 30);
    await page.mouse.down();
    await page.mouse.move(growl.x + growl.width / 2, growl.y - 10, { steps: 3 });
    await page.mouse.up();
    assert.equal(await focus(), '');
    const volume = await page.locator('#volume').boundingBox();
    await page.mouse.click(volume.x + 0.3 * volume.width, volume.y + volume.height / 2);
    assert.equal(await focus(), '');
    await page.focus('#control-growl');
    await page.keyboard.press('ArrowUp');
    assert.equal(await focus(), 'control-growl');
    // A closed list goes on by its arrows.
    await page.focus('#instrument');
    for (const at of ['1', '2']) {
      await page.keyboard.press('ArrowDown');
      assert.equal(await page.inputValue('#instrument'), at);
      assert.equal(await focus(), 'instrument');
    }
    await page.focus('#holes');
    await page.keyboard.press('Enter');
    await page.focus('#hole');
    const before = Number(await page.inputValue('#hole'));
    for (const by of [1, 2]) {
      await page.keyboard.press('ArrowDown');
      assert.equal(await page.inputValue('#hole'), String(before + by));
      assert.equal(await focus(), 'hole');
    }
    const place = await page.inputValue('#hole-place');
    await page.focus('#hole-place');
    await page.keyboard.press('Control+A');
    await page.keyboard.type('12.5');
    assert.equal(await page.inputValue('#hole-place'), '12.5', 'digits reach the field');
    await page.keyboard.press('Escape');
    assert.equal(await page.isVisible('#hole-panel'), false);
    assert.equal(await focus(), 'holes');
    await page.keyboard.press('Enter');
    assert.equal(await page.inputValue('#hole-place'), place);
    await page.focus('#hole-done');
    await page.keyboard.press('Enter');
    assert.equal(await focus(), 'holes');
    await page.click('#browse');
    await page.click('#browser [aria-label=Close]');
    assert.equal(await page.isVisible('#browser'), false);
    await end(opened);
  },

  async 'a screen reader finds one instrument that it can play'(browser) {
    const opened = await open(browser, server.address, PLAIN);
    const { page } = opened;
    const session = await opened.context.newCDPSession(page);
    const { nodes } = await session.send('Accessibility.getFullAXTree');
    const seen = nodes.filter((node) => !node.ignored).map(({ role, name }) => [role?.value, name?.value ?? '']);
    const players = seen.filter(([role]) => role === 'application');
    assert.equal(players.length, 1);
    assert.match(players[0][1], /keys from A to '.*arrows.*Escape/);
    assert.ok(!seen.some(([, name]) => name === 'C4' || /^W$/.test(name)), 'drawn keys have no voice');
    assert.ok(!seen.some(([role]) => /^(image|img|canvas)$/i.test(role)), 'nor has the picture');
    await page.focus('#keyboard');
    await page.keyboard.down('d');
    await until(page, LEVEL, HEARD);
    await page.keyboard.up('d');
    await end(opened);
  },
};

/** Relative luminance of a colour, and contrast of two (WCAG 2.2). */
const luminance = (colour) => {
  const [r, g, b] = colour.match(/[0-9.]+/g).map((x) => (x / 255 <= 0.04045 ? x / 255 / 12.92 : ((x / 255 + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};
const contrast = (a, b) => {
  const [low, high] = [luminance(a), luminance(b)].sort((x, y) => x - y);
  return (high + 0.05) / (low + 0.05);
};

const LOOKS = {
  async 'a low window keeps controls and volume, and buttons lie beside the clarinet'(browser) {
    for (const [width, height] of [[844, 390], [640, 400], [1280, 500], [320, 256], [320, 568]]) {
      const opened = await open(browser, server.address, { viewport: { width, height }, ...PLAIN });
      const { page } = opened;
      const size = `${width} x ${height}`;
      for (const id of ['control-lip', 'control-room', 'volume', 'keyboard', 'holes']) {
        await page.locator(`#${id}`).scrollIntoViewIfNeeded();
        // A click there reaches it.
        await page.click(`#${id}`, { trial: true, timeout: 5000 }).catch(() => assert.fail(`${size}: ${id} cannot be reached`));
      }
      assert.ok((await page.locator('#clarinet').boundingBox()).height > 100, `${size}: the clarinet has no room`);
      const over = await page.evaluate(() => {
        const { drawing } = globalThis.chalumeau.holes;
        const tools = document.querySelector('.tools').getBoundingClientRect();
        const top = document.getElementById('clarinet').getBoundingClientRect().top + drawing.axis;
        const half = drawing.outside(drawing.mouthpiece);
        return tools.bottom > top - half && tools.top < top + half;
      });
      assert.equal(over, false, `${size}: buttons over the mouthpiece`);
      assert.equal(await page.evaluate(() => document.documentElement.scrollWidth > innerWidth), false, `${size}: wider than the window`);
      const small = await page.$$eval('button, select, input, a', (all) =>
        all.filter((one) => one.offsetParent && Math.min(one.offsetWidth, one.offsetHeight) < 24).map((one) => one.id || one.textContent),
      );
      assert.deepEqual(small, [], `${size}: targets below 24 pixels`);
      await end(opened);
    }
  },

  async 'a pressed button is legible under the pointer and stays there'(browser) {
    for (const [width, height] of [[1440, 900], [1024, 768], [768, 1024], [620, 900]]) {
      const opened = await open(browser, server.address, { viewport: { width, height }, ...PLAIN });
      const { page } = opened;
      const before = await page.locator('#holes').boundingBox();
      await page.click('#holes');
      const look = await page.evaluate(() => {
        const { color, backgroundColor } = getComputedStyle(document.getElementById('holes'));
        return [color, backgroundColor];
      });
      assert.ok(contrast(...look) >= 4.5, `${width}: ${look}`);
      assert.deepEqual(await page.locator('#holes').boundingBox(), before);
      // One row of the header, or two.
      const { height: header } = await page.locator('header').boundingBox();
      assert.ok(header < 130, `${width}: ${header}`);
      await end(opened);
    }
  },

  async 'names of notes are legible'(browser) {
    for (const colorScheme of ['light', 'dark']) {
      const opened = await open(browser, server.address, { colorScheme, ...PLAIN });
      const { page } = opened;
      await page.keyboard.down('d');
      await until(page, LEVEL, HEARD);
      await page.keyboard.up('d');
      await silence(page);
      await page.waitForFunction(() => document.getElementById('written').classList.contains('quiet'));
      const found = await page.evaluate(() => {
        const style = (element) => getComputedStyle(element);
        const [note, octave] = [document.getElementById('written'), document.querySelector('.key.white i:not(:empty)')];
        return {
          note: [style(note).color, style(document.body).backgroundColor],
          octave: [style(octave).color, style(octave.parentElement).backgroundColor],
          opacities: [note, octave, octave.parentElement].map((element) => style(element).opacity),
          size: style(octave).fontSize,
        };
      });
      assert.deepEqual(found.opacities, ['1', '1', '1']);
      assert.equal(found.size, '11px');
      assert.ok(contrast(...found.note) >= 4.5 && contrast(...found.octave) >= 4.5, `${colorScheme}: ${contrast(...found.note)}, ${contrast(...found.octave)}`);
      await end(opened);
    }
  },
};

const VERSIONS = {
  async 'a new version is offered, and comes with a click'(browser) {
    const opened = await open(browser, server.address);
    const { page } = opened;
    await page.waitForFunction(async () => navigator.serviceWorker.controller && (await caches.keys()).some((name) => name.startsWith('chalumeau')));
    await page.waitForLoadState('networkidle');
    assert.equal(await page.isVisible('#update'), false);
    const text = await page.evaluate(async () => (await fetch('sw.js', { cache: 'reload' })).text());
    const other = await page.evaluate(async () => (await (await fetch('names.js')).text()));
    server.instead.set('sw.js', text.replace(/(?<=OWN\})[0-9a-f]{16}/, 'fedcba9876543210'));
    server.instead.set('names.js', `${other}\nglobalThis.isNew = true;\n`);
    await page.evaluate(async () => (await navigator.serviceWorker.getRegistration()).update());
    await page.waitForFunction(() => !document.getElementById('update').hidden);
    // Not before it is wanted.
    assert.equal(await page.evaluate(() => globalThis.isNew), undefined);
    await Promise.all([page.waitForEvent('load'), page.click('#update')]);
    await page.waitForFunction(() => globalThis.isNew && globalThis.chalumeau?.engine.node);
    assert.deepEqual(await page.evaluate(async () => (await caches.keys())), ['chalumeau/below/a/path-fedcba9876543210']);
    await end(opened);
  },

  async 'a server that takes the ends off names serves every page again from the browser'(browser) {
    const text = readFileSync(join(folder, 'listen.html'), 'utf8');
    server.instead.set('listen.html', { to: 'listen' });
    server.instead.set('listen', text);
    const opened = await open(browser, server.address);
    const { page } = opened;
    await page.waitForFunction(() => navigator.serviceWorker.controller);
    await page.goto(`${server.address}listen.html`);
    await page.waitForFunction(() => globalThis.listen);
    await end(opened);
  },

  async 'a copy in another folder keeps its own store'(browser) {
    const opened = await open(browser, server.address);
    const { page } = opened;
    await page.waitForFunction(() => navigator.serviceWorker.controller);
    await page.evaluate(() => caches.open('chalumeau/another/path-0123456789abcdef'));
    const sw = await page.evaluate(async () => (await fetch('sw.js', { cache: 'reload' })).text());
    server.instead.set('sw.js', sw.replace(/(?<=OWN\})[0-9a-f]{16}/, 'fedcba9876543210'));
    await page.evaluate(async () => (await navigator.serviceWorker.getRegistration()).update());
    await page.waitForFunction(() => !document.getElementById('update').hidden);
    await Promise.all([page.waitForEvent('load'), page.click('#update')]);
    const names = await page.evaluate(async () => (await caches.keys()).sort());
    assert.deepEqual(names, ['chalumeau/another/path-0123456789abcdef', 'chalumeau/below/a/path-fedcba9876543210']);
    await end(opened);
  },
};

// What a test has taken away is there for the next.
const tests = running(process.argv[4], () => server.instead.clear());
await tests.run(() => launch(own), SILENCE, MIDI, HOLES, HANDS, LOOKS, VERSIONS);
server.close();
tests.end();
