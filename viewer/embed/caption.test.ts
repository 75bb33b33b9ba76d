import { beforeEach, expect, it, vi } from "vitest";
import type { Readings } from "../ui/readings.ts";
import { Caption } from "./caption.ts";

function reading(loaded_bytes: number, settled: boolean): Readings {
  const progress = { loaded_bytes, isAbout: false, total_bytes: 4000, bound: "exact" } as const;
  const counts = { visible: 1, objects: 1, fetched_bytes: loaded_bytes, whole_bytes: undefined };
  return { cell: 0, inside: true, progress, settled, ...counts };
}

const UNTOLD = { ready: () => {}, goes: () => {} };

function captioned(): { line: { hidden: boolean; textContent: string }; caption: Caption; ready: () => number } {
  const line = { hidden: false, textContent: "" };
  let ready = 0;
  const caption = new Caption(line as unknown as HTMLElement, {
    ...UNTOLD,
    ready: () => {
      ready += 1;
    },
  });
  return { line, caption, ready: () => ready };
}

let isTouched = false;
beforeEach(() => {
  isTouched = false;
  vi.stubGlobal("matchMedia", () => ({ matches: isTouched }));
});

it("speaks of keys to who has some", () => {
  const { line, caption } = captioned();
  caption.mode("fly");
  expect(line.textContent).toContain("F to walk");
  isTouched = true;
  caption.mode("fly");
  expect(line.textContent).toBe("Flying: walls do not stop you.");
});

it("tells how much is here, is still once all is, and tells that one flies", () => {
  const { line, caption, ready } = captioned();
  caption.show(reading(1000, false));
  expect(line).toEqual({ hidden: false, textContent: "1.0 kB of 4.0 kB" });
  caption.show(reading(4000, true));
  caption.show(reading(4000, true));
  expect([line.hidden, ready()]).toEqual([true, 1]);
  caption.expect();
  caption.show(reading(4000, true));
  expect(ready()).toBe(2);
  caption.mode("fly");
  expect(line.hidden).toBe(false);
  caption.mode("walk");
  expect(line.hidden).toBe(true);
});

it("tells who begins high up that one flies, once all is here", () => {
  const { line, caption } = captioned();
  caption.mode("fly");
  caption.show(reading(1000, false));
  expect(line.textContent).toBe("1.0 kB of 4.0 kB");
  caption.show(reading(4000, true));
  expect(line).toEqual({ hidden: false, textContent: expect.stringMatching(/^Flying/) });
});

it("keeps a problem in sight, whatever comes after it", () => {
  const { line, caption, ready } = captioned();
  caption.problem("Memory is full.");
  caption.show(reading(1000, false));
  caption.show(reading(4000, true));
  caption.mode("walk");
  expect(line).toEqual({ hidden: false, textContent: "Memory is full." });
  expect(ready()).toBe(1);
  caption.problem("Something is missing.");
  expect(line.textContent).toBe("Something is missing.");
  expect(caption.hasFailed).toBe(true);
  caption.forgive();
  expect([caption.hasFailed, line.hidden]).toEqual([false, true]);
  caption.mode("fly");
  expect(line.hidden).toBe(false);
});

it("keeps a problem that passes only until the server answers", () => {
  const { line, caption } = captioned();
  caption.problem("The server does not answer.", true);
  caption.answered();
  expect([caption.hasFailed, line.hidden]).toEqual([false, true]);
  caption.problem("Something is missing.");
  caption.answered();
  expect(line.hidden).toBe(false);
});

it("says what takes long and offers the way back, but a problem first", () => {
  const line = { hidden: false, textContent: "" };
  const way = { hidden: true, textContent: "", onclick: null as unknown as () => void };
  const caption = new Caption(line as unknown as HTMLElement, UNTOLD, way as unknown as HTMLButtonElement);
  const now = () => [line.textContent, way.hidden];
  caption.mode("fly");
  caption.delay("It takes long.");
  expect(now()).toEqual(["It takes long.", true]);
  let went = 0;
  caption.offer("This link leads nowhere.", "Go to the start", () => {
    went += 1;
  });
  expect([...now(), way.textContent]).toEqual(["This link leads nowhere.", false, "Go to the start"]);
  caption.problem("Nothing comes.", true);
  expect(now()).toEqual(["Nothing comes.", true]);
  caption.answered();
  way.onclick();
  caption.delay();
  expect([...now(), went]).toEqual([expect.stringMatching(/^Flying/), true, 1]);
});

it("offers to try again what may be of use, and is silent about it then", () => {
  const line = { hidden: false, textContent: "" };
  const button = { hidden: true, textContent: "", onclick: null as unknown as () => void };
  let gone = 0;
  const told = {
    ...UNTOLD,
    goes: () => {
      gone += button.hidden ? 0 : 1;
    },
  };
  const caption = new Caption(line as unknown as HTMLElement, told, button as unknown as HTMLButtonElement);
  caption.problem("Nothing comes.");
  expect(button.hidden).toBe(true);
  let tried = 0;
  caption.problem("Nothing comes.", true, () => {
    tried += 1;
  });
  expect([button.hidden, button.textContent, gone]).toEqual([false, "Try again", 0]);
  button.onclick();
  caption.mode("walk");
  expect(gone).toBe(1);
  expect([tried, line.hidden, button.hidden, caption.hasFailed]).toEqual([1, true, true, false]);
});

it("says that nothing can be drawn until it can, whatever becomes of the line", () => {
  const { line, caption } = captioned();
  caption.problem("The server does not answer.", true);
  caption.dark("The graphics card is busy.");
  caption.answered();
  caption.forgive();
  expect(line.textContent).toBe("The graphics card is busy.");
  expect(caption.hasFailed).toBe(false);
  caption.problem("Something is missing.");
  expect(line.textContent).toBe("The graphics card is busy.");
  caption.dark();
  expect(line.textContent).toBe("Something is missing.");
});

it("tells who listens to the page all but how much is here", () => {
  const line = { hidden: false, textContent: "" } as unknown as HTMLElement;
  const heard: string[] = [];
  const announcer = { say: (topic: string, text: string) => heard.push(`${topic}: ${text}`) };
  const caption = new Caption(line, UNTOLD, undefined, announcer);
  for (const bytes of [1000, 2000, 3000]) caption.show(reading(bytes, false));
  expect([line.textContent, heard]).toEqual(["3.0 kB of 4.0 kB", []]);
  caption.problem("Nothing comes.", true);
  caption.answered();
  expect(heard).toEqual(["problem: Nothing comes.", "problem: "]);
});
