// Keeps the page, so that it opens without a network. `cargo xtask web` fills in version and files.

const NAME = 'chalumeau-VERSION';
const FILES = [/* FILES */];
const LATER = ['workshop.wasm'];

addEventListener('install', (event) => {
  // From the server, not from the browser's own store, whose files may be of different versions.
  const all = ['./', ...FILES].map((file) => new Request(file, { cache: 'reload' }));
  // Who has had a large file once can go on without a network after an update, too.
  const had = Promise.all(LATER.map((file) => caches.match(file).then((kept) => (kept ? [new Request(file, { cache: 'reload' })] : []))));
  event.waitUntil(had.then((more) => caches.open(NAME).then((cache) => cache.addAll([...all, ...more.flat()]))));
});

addEventListener('activate', (event) => {
  const old = (name) => name.startsWith('chalumeau-') && name !== NAME;
  event.waitUntil(
    caches.keys().then((names) => Promise.all(names.filter(old).map((name) => caches.delete(name)))).then(() => clients.claim()),
  );
});

/** What is large and not for everyone is kept once it has been wanted. */
async function fetched(request) {
  const answer = await fetch(request);
  if (answer.ok && LATER.some((file) => new URL(request.url).pathname.endsWith(`/${file}`))) {
    const copy = answer.clone();
    caches.open(NAME).then((cache) => cache.put(request, copy)).catch(() => {});
  }
  return answer;
}

// One version at a time: what was kept goes together, and a new version comes whole, once every page of the old one is closed.
addEventListener('fetch', (event) => {
  if (event.request.method !== 'GET' || new URL(event.request.url).origin !== location.origin) return;
  event.respondWith(caches.match(event.request, { cacheName: NAME, ignoreSearch: true }).then((kept) => kept ?? fetched(event.request)));
});
