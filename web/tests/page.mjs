// A browser with the page in it, and a server for both.

import { createReadStream, existsSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import { extname, join, normalize } from 'node:path';

const KINDS = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.json': 'application/json', '.wasm': 'application/wasm', '.svg': 'image/svg+xml' };

/** Serves a folder below a path, as a page on a host of others is; returns the address. */
export async function serve(folder) {
  const server = createServer(({ url }, answer) => {
    const path = join(folder, normalize(decodeURIComponent(new URL(url, 'http://x').pathname)).replace(/^\/below\/a\/path/, ''));
    const file = existsSync(path) && statSync(path).isDirectory() ? join(path, 'index.html') : path;
    if (!existsSync(file)) return answer.writeHead(404).end();
    answer.writeHead(200, { 'Content-Type': KINDS[extname(file)] ?? 'application/octet-stream' });
    createReadStream(file).pipe(answer);
  });
  await new Promise((ready) => server.listen(0, '127.0.0.1', ready));
  return { address: `http://localhost:${server.address().port}/below/a/path/`, close: () => server.close() };
}

/** Chromium of the system, without a window; `sound` is what its microphone hears. */
export async function launch(folder, sound) {
  const { chromium } = createRequire(join(folder, 'package.json'))('playwright-core');
  const microphone = sound ? ['--use-fake-ui-for-media-stream', '--use-fake-device-for-media-stream', `--use-file-for-fake-audio-capture=${sound}%noloop`] : [];
  return chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    args: ['--no-sandbox', '--disable-gpu', '--disable-dev-shm-usage', ...microphone],
  });
}

/** Opens the page; its errors end the test. */
export async function open(browser, address, options = {}) {
  const { before, early, other, ...browserOptions } = options;
  const context = await browser.newContext({ permissions: ['microphone'], ...browserOptions });
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
