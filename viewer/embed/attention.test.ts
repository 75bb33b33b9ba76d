import { expect, it } from "vitest";
import { Attention, type Attentive } from "./attention.ts";

function page() {
  const focus: { at: "elsewhere" | "input" | Attentive } = { at: "elsewhere" };
  const attention = new Attention<Attentive>(() => focus.at === "input");
  const make = (): Attentive => {
    const one = {
      get hasFocus(): boolean {
        return focus.at === one;
      },
    };
    attention.enters(one);
    return one;
  };
  const elements = [make(), make(), make()] as const;
  const listening = () => elements.map((one) => attention.has(one));
  return { focus, attention, elements, listening };
}

it("the one that has the focus listens, and nobody else", () => {
  const { focus, attention, elements, listening } = page();
  attention.uses(elements[0]);
  focus.at = elements[2];
  expect(listening()).toEqual([false, false, true]);
});

it("while none has the focus, the one that was used last listens, at first that which came first", () => {
  const { attention, elements, listening } = page();
  expect(listening()).toEqual([true, false, false]);
  attention.uses(elements[1]);
  expect(listening()).toEqual([false, true, false]);
  attention.leaves(elements[1]);
  expect(listening()).toEqual([true, false, false]);
  attention.enters(elements[1]);
  expect(listening()).toEqual([true, false, false]);
});

it("nobody listens while somebody types elsewhere", () => {
  const { focus, attention, elements, listening } = page();
  attention.uses(elements[1]);
  focus.at = "input";
  expect(listening()).toEqual([false, false, false]);
});
