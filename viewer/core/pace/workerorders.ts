/** How does a worker do what the page asks for? Orders go there, answers come back by their numbers. */
import { reasonOf } from "../basics/reason.ts";

/** What the worker answers to an order with this id. */
export type Answer<Result> =
  | { readonly id: number; readonly result: Result }
  | { readonly id: number; readonly error: string };

/** What of a `Worker` is needed. */
export interface WorkerPort<Order, Result> {
  postMessage(order: Order): void;
  onmessage: ((event: { readonly data: Answer<Result> }) => void) | null;
  onerror: ((event: { readonly message: string }) => void) | null;
  terminate(): void;
}

/** Orders to one worker. `work` says what it does, for messages: "decodes smooth LODs". */
export class WorkerOrders<Order extends object, Result> {
  private readonly waiting = new Map<number, { resolve: (result: Result) => void; reject: (error: Error) => void }>();
  private orders = 0;
  /** Why it does nothing any more, if so. */
  private failure: string | undefined;

  constructor(
    private readonly worker: WorkerPort<Order & { readonly id: number }, Result>,
    work: string,
  ) {
    worker.onmessage = ({ data }) => {
      const order = this.waiting.get(data.id);
      this.waiting.delete(data.id);
      if ("result" in data) order?.resolve(data.result);
      else order?.reject(new Error(data.error));
    };
    worker.onerror = ({ message }) => this.failAll(`the worker that ${work} has failed: ${message}`);
  }

  /** Has something done; fails as the worker does. */
  ask(order: Order): Promise<Result> {
    if (this.failure !== undefined) return Promise.reject(new Error(this.failure));
    const id = this.orders++;
    this.worker.postMessage({ ...order, id });
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }

  /** Ends the worker; what was asked for and is not done fails. */
  end(): void {
    this.worker.terminate();
    this.failAll("nothing is done here any more");
  }

  private failAll(why: string): void {
    this.failure = why;
    for (const { reject } of this.waiting.values()) reject(new Error(why));
    this.waiting.clear();
  }
}

/** What of a worker's global scope is needed. */
interface Scope<Order, Result> {
  onmessage: ((event: { readonly data: Order }) => void) | null;
  postMessage(answer: Answer<Result>, transfer: ArrayBuffer[]): void;
}

/** In a worker: does what is ordered, and answers; `moved` are the parts of a result that go to the page and are gone here. */
export function obey<Order extends { readonly id: number }, Result>(
  work: (order: Order) => Result | Promise<Result>,
  moved: (result: Result) => ArrayBuffer[],
): void {
  const scope = globalThis as unknown as Scope<Order, Result>;
  scope.onmessage = async ({ data }) => {
    const { id } = data;
    try {
      const result = await work(data);
      scope.postMessage({ id, result }, moved(result));
    } catch (error) {
      scope.postMessage({ id, error: reasonOf(error) }, []);
    }
  };
}
