/** How do events come on a slow line? One after the other, each when the line has carried it. */
import type { EventStream } from "./hearing.ts";

/** `carry` waits until so many bytes have come. */
export function slowStream(stream: EventStream, carry: (bytes: number) => Promise<void>): EventStream {
  let before = Promise.resolve();
  const isClosed = () => stream.readyState === CLOSED;
  return {
    addEventListener(name, listener) {
      stream.addEventListener(name, (event) => {
        before = before.then(() => carry(event.data.length));
        void before.then(() => {
          if (!isClosed()) listener(event);
        });
      });
    },
    get onerror() {
      return stream.onerror;
    },
    set onerror(listener) {
      stream.onerror = listener;
    },
    get readyState() {
      return stream.readyState;
    },
    close: () => stream.close(),
  };
}

const CLOSED = 2;
