import { expect, it } from "vitest";
import { HeldKeys } from "./heldkeys.ts";

const taken = (keys: HeldKeys) => [...keys.take()];

it("a key counts for as long as it is held, and no longer", () => {
  const keys = new HeldKeys();
  keys.press("KeyW");
  expect([taken(keys), taken(keys)]).toEqual([["KeyW"], ["KeyW"]]);
  keys.release("KeyW");
  expect(taken(keys)).toEqual([]);
});

it("a key that is let go before anybody asked counts once", () => {
  const keys = new HeldKeys();
  for (const _ of [1, 2]) {
    keys.press("KeyW");
    keys.press("KeyE");
    keys.release("KeyE");
    keys.release("KeyQ");
    expect([taken(keys), taken(keys)]).toEqual([["KeyW", "KeyE"], ["KeyW"]]);
    keys.release("KeyW");
  }
});

it("who turns to another window holds nothing", () => {
  const keys = new HeldKeys();
  for (const code of ["KeyW", "KeyE"]) keys.press(code);
  keys.release("KeyE");
  keys.clear();
  expect(taken(keys)).toEqual([]);
});

it("the key with the command sign lets go of all: macOS tells of none that is let go while that is held", () => {
  const keys = new HeldKeys();
  for (const meta of ["MetaLeft", "MetaRight"]) {
    keys.press("KeyW");
    taken(keys);
    keys.release(meta);
    expect(taken(keys)).toEqual([]);
  }
});
