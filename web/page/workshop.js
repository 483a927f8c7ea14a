// What takes long, off the page's thread: one worker that answers at once, and one that fits and is ended where its answer has
// become worthless; a third prepares a file that the user opens. All play the same module, which is fetched when it is first needed.

/** The module, or the worker around it, has not come. */
export class NotLoaded extends Error {
  constructor(why) {
    super(`A part of the page could not be loaded (${why}). Try again, or reload the page.`);
  }
}

export class Workshop {
  /** Asks the worker for what takes milliseconds, or a second. */
  async ask(question) {
    const own = (this.quick ??= this.worker());
    try {
      return await own.ask(question);
    } catch (error) {
      // The next question has it loaded again.
      if (error instanceof NotLoaded && this.quick === own) this.quick = undefined;
      throw error;
    }
  }

  /** Asks for what takes seconds or minutes; a question before it is given up and never answered. */
  askLong(question) {
    this.long?.end();
    this.long = this.worker();
    return this.long.ask(question);
  }

  /** Asks for what takes minutes and goes on whatever else is asked; only another such question ends it. */
  async askApart(question) {
    this.apart?.end();
    const own = (this.apart = this.worker());
    try {
      return await own.ask(question);
    } finally {
      own.end();
    }
  }

  worker() {
    const worker = new Worker(new URL('workshop-worker.js', import.meta.url), { type: 'module' });
    const waiting = new Map();
    let asked = 0;
    const fail = (why) => {
      worker.terminate();
      waiting.forEach(({ reject }) => reject(new NotLoaded(why)));
      waiting.clear();
    };
    worker.onmessage = ({ data: { number, answer, failed, isLost } }) => {
      if (isLost) return fail(failed);
      const { resolve, reject } = waiting.get(number);
      waiting.delete(number);
      if (failed) reject(new Error(failed));
      else resolve(answer);
    };
    worker.onerror = (error) => fail(error.message ?? 'is there a network?');
    return {
      ask: (question) =>
        new Promise((resolve, reject) => {
          asked += 1;
          waiting.set(asked, { resolve, reject });
          worker.postMessage({ number: asked, question });
        }),
      end: () => worker.terminate(),
    };
  }
}
