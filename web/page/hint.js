// The line below the clarinet: what failed, else what was said last, else what the player can do.

/** What was said last stays for a while, ms. */
const SAID_MS = 6000;

export class Hint {
  /** `usual` gives what to say where nothing has happened, and `urgent` what goes before all but a failure, or ''. */
  constructor(element, usual, urgent) {
    Object.assign(this, { element, usual, urgent, failure: '', said: '' });
  }

  /** There is no sound. Said until some is made. */
  fail(error) {
    const help = error.isLasting ? '' : ' Reload the page to try again.';
    this.failure = `No sound: ${String(error.message ?? error).replace(/\.$/, '')}.${help}`;
    this.tell();
  }

  /** There is sound. */
  pass() {
    this.failure = '';
  }

  say(text) {
    this.said = text;
    clearTimeout(this.holding);
    this.holding = setTimeout(() => {
      this.said = '';
      this.tell();
    }, SAID_MS);
    this.tell();
  }

  tell() {
    const { element, failure, said } = this;
    element.classList.toggle('failed', failure !== '');
    const text = failure || this.urgent() || said || this.usual();
    if (element.textContent !== text) element.textContent = text;
  }
}
