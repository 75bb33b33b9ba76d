import { expect, it } from "vitest";
import { Json } from "./json.ts";

const read = () =>
  Json.parse('{"rooms": [{"at": [1, 2, 3]}, {"at": [1, "2", 3]}], "by": {"m1": {"at": [1]}}}', "the house");

it("says where something is wrong, through lists and tables", () => {
  const at = (json: Json) => json.field("at").vec3();
  expect(() => read().field("rooms").list(at)).toThrow("the house.rooms[1].at[1] should be a finite number");
  expect(() => read().field("by").entries(at)).toThrow("the house.by.m1.at should be a list of 3 numbers");
  expect(
    at(
      read()
        .field("rooms")
        .list((room) => room)[0] ?? read(),
    ),
  ).toEqual([1, 2, 3]);
});
