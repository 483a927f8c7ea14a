// Keeps the page, so that it opens without a network. `cargo xtask web` fills in version and files.

const NAME = 'chalumeau-VERSION';
const FILES = [/* FILES */];
const LATER = 'workshop.wasm';
/** Whether that is an address of it, in whatever version. */
const isLater = (address) => /\/workshop(-[0-9a-f]+)?\.wasm$/.test(new URL(address).pathname);

/** Whether it has been kept before. */
async function hadLater() {
  const own = (await caches.keys()).filter((name) => name.startsWith('chalumeau-'));
  const kept = await Promise.all(own.map(async (name) => (await caches.open(name)).keys()));
  return kept.flat().some(({ url }) => isLater(url));
}

addEventListener('install', (event) => {
  // From the server, not from the browser's own store, whose files may be of different versions.
  const all = ['./', ...FILES].map((file) => new Request(file, { cache: 'reload' }));
  const keep = async () => {
    // Who has had the large file once can go on without a network after an update, too.
    if (await hadLater()) all.push(new Request(LATER, { cache: 'reload' }));
    await (await caches.open(NAME)).addAll(all);
  };
  event.waitUntil(keep());
});

// The user wants the new version now.
addEventListener('message', ({ data }) => data === 'now' && skipWaiting());

addEventListener('activate', (event) => {
  const old = (name) => name.startsWith('chalumeau-') && name !== NAME;
  event.waitUntil(
    caches.keys().then((names) => Promise.all(names.filter(old).map((name) => caches.delete(name)))).then(() => clients.claim()),
  );
});

/** What is large and not for everyone is kept once it has been wanted. */
async function fetched(request) {
  const answer = await fetch(request);
  if (answer.ok && isLater(request.url)) {
    const copy = answer.clone();
    caches.open(NAME).then((cache) => cache.put(request, copy)).catch(() => {});
  }
  return answer;
}

// One version at a time: what was kept goes together, and a new version comes whole, once every page of the old one is
// closed, or the user asks for it.
addEventListener('fetch', (event) => {
  if (event.request.method !== 'GET' || new URL(event.request.url).origin !== location.origin) return;
  event.respondWith(caches.match(event.request, { cacheName: NAME, ignoreSearch: true }).then((kept) => kept ?? fetched(event.request)));
});
