/** What does the worker do that decodes smooth LODs? What the page orders, one order after the other. */
import { obey } from "../pace/workerorders.ts";
import type { Order } from "./smoothdecoding.ts";
import { type Refined, SmoothStream } from "./smoothstream.ts";

const streams = new Map<number, SmoothStream>();

function work(order: Order & { readonly id: number }): Refined | undefined {
  if ("close" in order) {
    streams.delete(order.close);
    return undefined;
  }
  const stream = streams.get(order.stream) ?? new SmoothStream(order.materials);
  streams.set(order.stream, stream);
  const taking = stream.take(order.rungs);
  let step = taking.next();
  while (!step.done) step = taking.next();
  return step.value;
}

obey(work, (refined) => (refined ? [refined.glb] : []));
