import { expect, it } from "vitest";
import type { Seedling } from "./growing.ts";
import { GrowthQueue } from "./growthqueue.ts";

const seedling = (part: string): Seedling => ({
  ...{ rules: "", imports: new Map(), part, parameters: {} },
  ...{ seed: 0, triangles: 12 },
});

it("what grows next is the most urgent, two at a time, and nothing that is not wanted any more", async () => {
  const ordered: (string | undefined)[] = [];
  const done: ((glb: ArrayBuffer) => void)[] = [];
  const queue = new GrowthQueue({
    grow: ({ part }) => {
      ordered.push(part);
      return part === "wrong" ? Promise.reject(new Error("wrong rules")) : new Promise((resolve) => done.push(resolve));
    },
    end: () => {},
  });
  const finishOne = async () => {
    done.shift()?.(new ArrayBuffer(1));
    await new Promise((resolve) => setTimeout(resolve));
  };
  const grow = (part: string, priority: number, isWanted = true) =>
    queue.grow(seedling(part), { load: { priority }, begin: () => isWanted });
  const first = grow("first", 9);
  const others = [grow("second", 8), grow("late", 7), grow("left", 1, false), grow("soon", 3), grow("then", 3)];
  expect(ordered).toEqual(["first", "second"]);
  await finishOne();
  expect((await first)?.byteLength).toBe(1);
  expect(ordered).toEqual(["first", "second", "soon"]);
  await expect(others[2]).resolves.toBeUndefined();
  await finishOne();
  await finishOne();
  expect(ordered).toEqual(["first", "second", "soon", "then", "late"]);
  await finishOne();
  await finishOne();
  await Promise.all(others);
  await expect(grow("wrong", 1)).rejects.toThrow("wrong rules");
  await expect(grow("wrong", 1)).rejects.toThrow("wrong rules");
  void grow("again", 1);
  expect(ordered.at(-1)).toBe("again");
  void grow("one more", 1);
  const load = { priority: 5 };
  void queue.grow(seedling("urgent by now"), { load, begin: () => true });
  void grow("less urgent", 4);
  load.priority = 3;
  await finishOne();
  expect(ordered.at(-1)).toBe("urgent by now");
});
