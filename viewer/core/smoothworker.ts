/** What does the worker do that decodes smooth LODs? What the page orders, one order after the other. */
import type { Answer, Order } from "./smoothdecoding.ts";
import { SmoothStream } from "./smoothstream.ts";

/** What of a worker's global scope is needed. */
interface Scope {
  onmessage: ((event: { readonly data: Order }) => void) | null;
  postMessage(answer: Answer, transfer: ArrayBuffer[]): void;
}

const scope = globalThis as unknown as Scope;
const streams = new Map<number, SmoothStream>();

scope.onmessage = ({ data }) => {
  if ("close" in data) {
    streams.delete(data.close);
    return;
  }
  const { id, stream, rungs, materials } = data;
  try {
    const known = streams.get(stream) ?? new SmoothStream(materials);
    streams.set(stream, known);
    const taking = known.take(rungs);
    let step = taking.next();
    while (!step.done) step = taking.next();
    scope.postMessage({ id, refined: step.value }, [step.value.glb]);
  } catch (error) {
    scope.postMessage({ id, error: error instanceof Error ? error.message : String(error) }, []);
  }
};
