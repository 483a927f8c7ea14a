// Keeps the page, so that it opens without a network. `cargo xtask web` fills in version and files.

/** Another copy of the page, in another folder, has a store of its own. */
const OWN = `chalumeau${new URL('.', location.href).pathname.replace(/\/$/, '')}-`;
const NAME = `${OWN}VERSION`;
const FILES = [/* FILES */];
const LATER = 'workshop.wasm';
/** Whether that is an address of it, in whatever version. */
const isLater = (address) => /\/workshop(-[0-9a-f]+)?\.wasm$/.test(new URL(address).pathname);

/** Whether a store is of this copy, in whatever version. */
const isOwn = (name) => name.startsWith(OWN) && /^[0-9a-f]+$/.test(name.slice(OWN.length));

/** Whether it has been kept before. */
async function hadLater() {
  const own = (await caches.keys()).filter(isOwn);
  const kept = await Promise.all(own.map(async (name) => (await caches.open(name)).keys()));
  return kept.flat().some(({ url }) => isLater(url));
}

addEventListener('install', (event) => {
  // From the server, not from the browser's own store, whose files may be of different versions.
  const all = ['./', ...FILES].map((file) => new Request(file, { cache: 'reload' }));
  const keep = async () => {
    // Who has had the large file once can go on without a network after an update, too.
    if (await hadLater()) all.push(new Request(LATER, { cache: 'reload' }));
    // What cannot be fetched whole is not kept at all.
    const answers = await Promise.all(all.map(whole));
    const cache = await caches.open(NAME);
    await Promise.all(all.map((request, at) => cache.put(request, answers[at])));
  };
  event.waitUntil(keep());
});

/** A file as it is kept. A server may redirect (`listen.html` to `listen`), and browsers refuse to open a page that was. */
async function whole(request) {
  const answer = await fetch(request);
  if (!answer.ok) throw new Error(`${request.url}: ${answer.status}`);
  return answer.redirected ? new Response(await answer.blob(), { headers: answer.headers }) : answer;
}

// The user wants the new version now.
addEventListener('message', ({ data }) => data === 'now' && skipWaiting());

addEventListener('activate', (event) => {
  const old = (name) => isOwn(name) && name !== NAME;
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
