// A new version of the page is kept beside the old one until the user asks for it, or closes every page.

/** `offer` is called when there is one; `take` then brings it. */
export class Update {
  constructor(offer) {
    this.offer = offer;
    const { serviceWorker } = navigator;
    if (!serviceWorker) return;
    // The first version of all takes a page that had none: nothing is new there.
    let hadOne = Boolean(serviceWorker.controller);
    serviceWorker.addEventListener('controllerchange', () => {
      if (this.isWanted) location.reload();
      // Another page has asked for it.
      else if (hadOne) offer();
      hadOne = true;
    });
    // Where it is blocked there is none.
    serviceWorker.register('sw.js').then((registration) => registration && this.watch(registration), () => {});
  }

  watch(registration) {
    this.registration = registration;
    const look = () => registration.waiting && navigator.serviceWorker.controller && this.offer();
    look();
    registration.addEventListener('updatefound', () => registration.installing?.addEventListener('statechange', look));
  }

  take() {
    this.isWanted = true;
    const waiting = this.registration?.waiting;
    if (waiting) waiting.postMessage('now');
    else location.reload();
  }
}
