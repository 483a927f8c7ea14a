// A browser with the page in it, and a server for both.

import { createReadStream, existsSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import { basename, extname, join, normalize } from 'node:path';

const KINDS = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.json': 'application/json', '.wasm': 'application/wasm', '.svg': 'image/svg+xml' };

/** Places in the worklet's picture: `PICTURE_NAMES` of web/src/playing.rs. */
export const [KEY, SOUNDING, DYNAMIC, LEVEL] = [0, 1, 5, 7];
/** A sound that is meant, and silence, of full scale. */
export const [HEARD, SILENT] = [0.01, 0.0005];

/**
 * Serves a folder below a path, as a page on a host of others is; returns the address. `instead` has texts that are served in place
 * of files, by their names, null for files that are lost, `{ to }` for a name that is redirected to another, or a function that gives
 * one of these or, after a time, nothing.
 */
export async function serve(folder) {
  const instead = new Map();
  const server = createServer(async ({ url }, answer) => {
    const path = join(folder, normalize(decodeURIComponent(new URL(url, 'http://x').pathname)).replace(/^\/below\/a\/path/, ''));
    const name = basename(path);
    const text = await (typeof instead.get(name) === 'function' ? instead.get(name)() : instead.get(name));
    if (text?.to) return answer.writeHead(301, { Location: text.to }).end();
    if (text !== undefined) return answer.writeHead(text === null ? 404 : 200, { 'Content-Type': KINDS[extname(path) || '.html'] ?? 'text/plain' }).end(text ?? '');
    const file = existsSync(path) && statSync(path).isDirectory() ? join(path, 'index.html') : path;
    if (!existsSync(file)) return answer.writeHead(404).end();
    answer.writeHead(200, { 'Content-Type': KINDS[extname(file)] ?? 'application/octet-stream' });
    createReadStream(file).pipe(answer);
  });
  await new Promise((ready) => server.listen(0, '127.0.0.1', ready));
  return { address: `http://localhost:${server.address().port}/below/a/path/`, instead, close: () => server.close() };
}

/** A host of which nothing but http is known. */
export const PLAIN_HOST = 'page.test';

/** Chromium of the system, without a window; `sound` is what its microphone hears. */
export async function launch(folder, sound) {
  const { chromium } = createRequire(join(folder, 'package.json'))('playwright-core');
  const microphone = sound ? ['--use-fake-ui-for-media-stream', '--use-fake-device-for-media-stream', `--use-file-for-fake-audio-capture=${sound}%noloop`] : [];
  return chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    // A name that is no secure origin, as the address of a machine in the network.
    args: [`--host-resolver-rules=MAP ${PLAIN_HOST} 127.0.0.1`, '--no-sandbox', '--disable-gpu', '--disable-dev-shm-usage', ...microphone],
  });
}

/** Opens the page, alone or in a context `beside` others; its errors end the test. */
export async function open(browser, address, options = {}) {
  const { before, early, other, beside, ...browserOptions } = options;
  const context = beside ?? (await browser.newContext({ permissions: ['microphone'], ...browserOptions }));
  const page = await context.newPage();
  const errors = [];
  page.on('pageerror', (error) => errors.push(String(error)));
  page.on('console', (message) => message.type() === 'error' && errors.push(`${message.text()} ${message.location().url}`.trim()));
  if (before) await page.addInitScript(before);
  await page.addInitScript(() => {
    globalThis.told = [];
    addEventListener('chalumeau', ({ detail }) => detail.picture && globalThis.told.push({ at: performance.now(), ...detail }));
  });
  await page.goto(address);
  if (other) return { page, context, errors };
  // From here on it takes keys; the module may still be on its way.
  await page.waitForFunction(() => globalThis.chalumeau);
  if (!early) await page.waitForFunction(() => globalThis.chalumeau.engine.node);
  return { page, context, errors };
}

export const pictures = (page) => page.evaluate(() => globalThis.told);
export const latest = async (page) => (await pictures(page)).at(-1).picture;
/** Waits until a picture's number is as asked. */
export const until = (page, place, low, high = Infinity, timeout = 15000) =>
  page.waitForFunction(
    ([place, low, high]) => {
      const now = globalThis.told.at(-1)?.picture[place];
      return now >= low && now < high;
    },
    [place, low, high],
    { timeout, polling: 20 },
  );
/** A picture's number when it has stopped moving: a quarter of a second of sound later it is the same. */
export const settled = async (page, place) => {
  for (let before = NaN; ; ) {
    const seen = (await pictures(page)).length;
    await page.waitForFunction((count) => globalThis.told.length >= count, seen + 8, { polling: 20 });
    const now = (await latest(page))[place];
    if (Math.abs(now - before) < 0.01) return now;
    before = now;
  }
};
export const silence = (page) => until(page, LEVEL, 0, SILENT);

/**
 * Runs tests, all or those with `wanted` in their names, each after `begin`, and ends the program with their result. A test that
 * fails runs once more, in a new browser: on a busy machine a browser may stand still for longer than a test waits. What failed is
 * said again at the end.
 */
export function running(wanted = '', begin = () => {}) {
  let ran = 0;
  const failures = [];
  /** Whether it passed. */
  async function passes(name, test, browser) {
    const began = Date.now();
    begin();
    try {
      const says = await test(browser);
      console.log(`ok    ${name} (${((Date.now() - began) / 1000).toFixed(1)} s)${says ? `: ${says}` : ''}`);
      return true;
    } catch (error) {
      const failure = `${name}\n${error.stack}`;
      console.log(`FAIL  ${failure}`);
      failures.push({ name, failure });
      return false;
    }
  }
  async function inBrowser(start, tests) {
    const browser = await start();
    const again = [];
    for (const [name, test] of tests) {
      if (!(await passes(name, test, browser))) again.push([name, test]);
    }
    // One that has crashed is closed already.
    await browser?.close().catch(() => {});
    return again;
  }
  const failed = new Set();
  return {
    /** `start` makes the browser in which they run, or nothing. */
    async run(start, ...groups) {
      const tests = groups.flatMap((tests) => Object.entries(tests)).filter(([name]) => name.includes(wanted));
      if (tests.length === 0) return;
      ran += tests.length;
      const again = await inBrowser(start, tests);
      if (again.length === 0) return;
      console.log(`again, in a new browser: ${again.map(([name]) => name).join('; ')}`);
      for (const [name] of await inBrowser(start, again)) failed.add(name);
    },
    end() {
      if (ran === 0) console.log(`FAIL  no test has ${wanted} in its name`);
      for (const { name, failure } of failures) console.log(`${failed.has(name) ? 'failed' : 'failed, but not again'}: ${failure}`);
      process.exitCode = failed.size > 0 || ran === 0 ? 1 : 0;
    },
  };
}
