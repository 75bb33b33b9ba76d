/** What was asked, and what went wrong? Requests by kind, and errors by kind and words. */
export class Tally {
  requests = new Map();
  errors = new Map();

  asked(kind) {
    this.requests.set(kind, (this.requests.get(kind) ?? 0) + 1);
  }

  wrong(kind, error) {
    const words = `${kind}: ${error.message.slice(0, 300)}`;
    if (!this.errors.has(words)) console.error(`wrong: ${words}`);
    this.errors.set(words, (this.errors.get(words) ?? 0) + 1);
  }

  get asks() {
    return [...this.requests.values()].reduce((a, b) => a + b, 0);
  }

  get wrongs() {
    return [...this.errors.values()].reduce((a, b) => a + b, 0);
  }
}

/** Fails with these words unless it is so. */
export function insist(so, words) {
  if (!so) throw new Error(words);
}

export const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

export const pick = (list) => list[Math.floor(Math.random() * list.length)];

/** Does a step again and again until it is over; a step that fails is an error, and the next one is tried all the same. */
export async function keepDoing(kind, soak, step) {
  while (!soak.over) {
    try {
      await step();
    } catch (error) {
      soak.tally.wrong(kind, error);
      await sleep(1000);
    }
  }
}
