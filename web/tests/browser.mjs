// The page in Chromium: node browser.mjs PAGE FOLDER. Pictures go to FOLDER.

import assert from 'node:assert/strict';
import { join } from 'node:path';
import { scores } from './module.mjs';
import { launch, open, serve } from './page.mjs';
import { QUIET_S, SENTENCES, blow, room, sequence, speech, writeWav } from './sounds.mjs';

const [folder, own] = process.argv.slice(2);
/** Places in the worklet's picture. */
const [KEY, SOUNDING, DYNAMIC, LEVEL] = [0, 1, 5, 7];
/** A sound that is meant, and silence, of full scale. */
const [HEARD, SILENT] = [0.01, 0.0005];
const SIZES = { phone: [390, 844], tablet: [820, 1180], desktop: [1440, 900] };

const server = await serve(folder);
const pictures = (page) => page.evaluate(() => globalThis.told);
const latest = async (page) => (await pictures(page)).at(-1).picture;
/** Waits until a picture's number is as asked. */
const until = (page, place, low, high = Infinity, timeout = 15000) =>
  page.waitForFunction(
    ([place, low, high]) => {
      const now = globalThis.told.at(-1)?.picture[place];
      return now >= low && now < high;
    },
    [place, low, high],
    { timeout, polling: 20 },
  );
/** A picture's number when it has stopped moving: a quarter of a second of sound later it is the same. */
const settled = async (page, place) => {
  for (let before = NaN; ; ) {
    const seen = (await pictures(page)).length;
    await page.waitForFunction((count) => globalThis.told.length >= count, seen + 8, { polling: 20 });
    const now = (await latest(page))[place];
    if (Math.abs(now - before) < 0.01) return now;
    before = now;
  }
};
const silence = (page) => until(page, LEVEL, 0, SILENT);

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
    await page.waitForFunction(() => document.getElementById('breathing').textContent === 'Breath found: CC2');
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

  async 'controls work without a mouse'(browser) {
    const { page, context, errors } = await open(browser, server.address, { serviceWorkers: 'block' });
    const unnamed = await page.$$eval('button, select, input, [tabindex]', (all) =>
      all.filter((element) => !(element.getAttribute('aria-label') || element.textContent.trim() || element.labels?.[0]?.textContent.trim())).map((element) => element.outerHTML),
    );
    assert.deepEqual(unnamed, []);
    const growl = page.locator('#control-growl');
    await growl.focus();
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
    await page.waitForFunction(async () => (await caches.keys()).some((name) => name.startsWith('chalumeau-')) && navigator.serviceWorker.controller);
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

const wanted = process.argv[4] ?? '';
let failed = 0;
async function run(tests, ...args) {
  for (const [name, test] of Object.entries(tests).filter(([name]) => name.includes(wanted))) {
    const began = Date.now();
    try {
      const says = await test(...args);
      console.log(`ok    ${name} (${((Date.now() - began) / 1000).toFixed(1)} s)${says ? `: ${says}` : ''}`);
    } catch (error) {
      failed += 1;
      console.log(`FAIL  ${name}\n${error.stack}`);
    }
  }
}

const browser = await launch(own);
await run(TESTS, browser);
await browser.close();
await run(MICROPHONE);
server.close();
process.exitCode = failed > 0 ? 1 : 0;
