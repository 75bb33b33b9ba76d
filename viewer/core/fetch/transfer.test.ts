import { setFlagsFromString } from "node:v8";
import { runInNewContext } from "node:vm";
import { expect, it, vi } from "vitest";
import { FETCH_DEFAULTS, FetchQueue } from "./fetchqueue.ts";
import { pause, transfer } from "./transfer.ts";

setFlagsFromString("--expose-gc");
const collectGarbage: () => void = runInNewContext("gc");

/** How many of some things are still held by somebody, once what nobody holds was collected. */
async function held(things: readonly WeakRef<object>[]): Promise<number> {
  await new Promise((resolve) => setTimeout(resolve, 5));
  collectGarbage();
  return things.filter((thing) => thing.deref()).length;
}

it("what came is nobody's any more once who asked for it has let it go", async () => {
  const fetch = async () => new Response(new Uint8Array(1000));
  const queue = new FetchQueue({ ...FETCH_DEFAULTS, digest: undefined, fetch });
  const came: WeakRef<object>[] = [];
  for (let i = 0; i < 10; i += 1) came.push(new WeakRef(await queue.request(`o/${i}`, 1)));
  await vi.waitFor(async () => expect(await held(came)).toBe(0), { timeout: 4000 });
  expect(queue.tally).toMatchObject({ requests: 10, bytes: 10_000 });
});

it("what is called off before it begins is not waited for", async () => {
  const calledOff = new AbortController();
  calledOff.abort();
  const silent = () => new Promise<Response>(() => {});
  const options = { fetch: silent, signal: calledOff.signal, cache: "default", stall_ms: 60_000, quiet_ms: 60_000 };
  await expect(transfer("a", options as never, () => {})).rejects.toMatchObject({ kind: "unreachable" });
});

it("a pause that is over holds on to nothing of what might have called it off", async () => {
  const { signal } = new AbortController();
  const [add, remove] = [vi.spyOn(signal, "addEventListener"), vi.spyOn(signal, "removeEventListener")];
  await pause(1, signal);
  expect(add.mock.calls.length).toBe(1);
  expect(remove.mock.calls).toEqual([add.mock.calls[0]?.slice(0, 2)]);
});
