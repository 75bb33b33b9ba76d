/** What does the worker do that keeps files? Puts what the page orders into the browser's cache. */
import { obey } from "../pace/workerorders.ts";
import { type Keeping, keepIn } from "./compartments.ts";

obey<Keeping & { readonly id: number }, void>(
  (order) => keepIn(caches, order),
  () => [],
);
