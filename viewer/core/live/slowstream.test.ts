import { expect, it } from "vitest";
import type { EventStream } from "./hearing.ts";
import { slowStream } from "./slowstream.ts";

/** A stream that tells when it is told to, and a line that carries when it is let. */
function slow() {
  const listeners = new Map<string, (event: { data: string }) => void>();
  const stream = {
    addEventListener: (name, listener) => listeners.set(name, listener),
    onerror: null,
    readyState: 1,
    close: () => {},
  } satisfies EventStream;
  const asked_bytes: number[] = [];
  const waiting: (() => void)[] = [];
  const carry = (bytes: number) => {
    asked_bytes.push(bytes);
    return new Promise<void>((resolve) => waiting.push(resolve));
  };
  const heard: string[] = [];
  const slowed = slowStream(stream, carry);
  for (const name of ["pose", "door"]) slowed.addEventListener(name, ({ data }) => heard.push(data));
  const tell = (name: string, data: string) => listeners.get(name)?.({ data });
  const turn = () => new Promise((resolve) => setTimeout(resolve, 0));
  /** Lets the line carry one more. */
  const carries = async () => {
    await turn();
    waiting.shift()?.();
    await turn();
  };
  return { stream, slowed, heard, asked_bytes, tell, carries };
}

it("tells events in their order, each when it has come", async () => {
  const { heard, asked_bytes, tell, carries } = slow();
  tell("pose", "one");
  tell("door", "two two");
  expect(heard).toEqual([]);
  await carries();
  expect(heard).toEqual(["one"]);
  await carries();
  expect(heard).toEqual(["one", "two two"]);
  expect(asked_bytes).toEqual([3, 7]);
});

it("tells nothing of a stream that was closed, and hears when it fails", async () => {
  const { stream, slowed, heard, tell, carries } = slow();
  const failed = () => {};
  slowed.onerror = failed;
  expect(stream.onerror).toBe(failed);
  tell("pose", "one");
  stream.readyState = 2;
  await carries();
  expect(heard).toEqual([]);
  expect(slowed.readyState).toBe(2);
});
