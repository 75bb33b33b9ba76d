import { expect, it } from "vitest";
import { HeldKeys } from "./heldkeys.ts";

it("a key counts for as long as it is held, and once when it was let go before anybody asked", () => {
  const keys = new HeldKeys();
  keys.press("KeyW");
  keys.press("KeyE");
  keys.release("KeyE");
  expect([...keys.take()]).toEqual(["KeyW", "KeyE"]);
  expect([...keys.take()]).toEqual(["KeyW"]);
  keys.release("KeyW");
  keys.release("KeyQ");
  expect([...keys.take()]).toEqual(["KeyW"]);
  expect([...keys.take()]).toEqual([]);
});

it("who turns to another window holds nothing", () => {
  const keys = new HeldKeys();
  for (const code of ["KeyW", "KeyE"]) keys.press(code);
  keys.release("KeyE");
  keys.clear();
  expect([...keys.take()]).toEqual([]);
});
