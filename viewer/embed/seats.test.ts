import { expect, test } from "vitest";
import { Seats } from "./seats.ts";

/** A page with room for two, and what became of those on it. */
function page(...names: string[]) {
  const seats = new Seats<{ draws(): void; rests(): void }>(2);
  const told: string[] = [];
  const all = Object.fromEntries(
    names.map((name) => [name, { draws: () => told.push(`${name} draws`), rests: () => told.push(`${name} rests`) }]),
  );
  const one = (name: string) => all[name] as { draws(): void; rests(): void };
  for (const name of names) seats.enters(one(name));
  const sees = (name: string, isInView = true) => seats.sees(one(name), isInView);
  const heard = () => told.splice(0);
  return { seats, one, sees, heard };
}

test("as many draw as there is room for, in view or not", () => {
  expect(page("a", "b", "c").heard()).toEqual(["a draws", "b draws"]);
});

test("who comes into view takes the place of who has been out of view for longest", () => {
  const { sees, heard } = page("a", "b", "c", "d");
  sees("b");
  sees("a");
  sees("b", false);
  sees("a", false);
  heard();
  sees("c");
  sees("d");
  expect(heard()).toEqual(["b rests", "c draws", "a rests", "d draws"]);
  sees("c", false);
  sees("a");
  expect(heard()).toEqual(["c rests", "a draws"]);
});

test("nobody in view makes room for others; who waits draws as soon as there is some", () => {
  const { seats, one, sees, heard } = page("a", "b", "c", "d");
  for (const name of ["a", "b", "c", "d"]) sees(name);
  expect(heard()).toEqual(["a draws", "b draws"]);
  sees("a", false);
  expect(heard()).toEqual(["a rests", "c draws"]);
  seats.leaves(one("b"));
  expect(heard()).toEqual(["d draws"]);
  expect(["a", "c", "d"].map((name) => seats.has(one(name)))).toEqual([false, true, true]);
});

test("who has left is not told of anything any more", () => {
  const { seats, one, sees, heard } = page("a", "b", "c");
  seats.leaves(one("c"));
  seats.leaves(one("a"));
  heard();
  sees("c");
  sees("a", false);
  expect(heard()).toEqual([]);
});
