import { expect, it } from "vitest";
import { Discretion } from "./discretion.ts";

it("what is wrong is said always, what concerns who is there only to them, and no more of it than holds", () => {
  const heard: string[] = [];
  let isThere = false;
  const announcer = { say: (topic: string, text: string) => heard.push(`${topic}: ${text}`) };
  const discretion = new Discretion(announcer, () => isThere);
  discretion.say("manner", "Flying");
  discretion.say("door", "open door");
  discretion.say("problem", "Nothing comes.");
  expect(heard.splice(0)).toEqual(["problem: Nothing comes."]);
  discretion.say("door", "");
  expect(heard.splice(0)).toEqual(["door: "]);
  isThere = true;
  discretion.comes();
  expect(heard.splice(0)).toEqual(["manner: Flying", "door: "]);
  discretion.say("moved", "door is open now");
  expect(heard).toEqual(["moved: door is open now"]);
});
