import { expect, it } from "vitest";
import type { SceneSummary } from "../core/documents/documents.ts";
import { labelled } from "./scenelabels.ts";

it("adds the names of scenes that have the same title", () => {
  const scenes = [
    { scene: "a", title: "Museum" },
    { scene: "b", title: "Town" },
    { scene: "c", title: "Museum" },
  ] as unknown as SceneSummary[];
  expect(labelled(scenes).map(({ label }) => label)).toEqual(["Museum (a)", "Town", "Museum (c)"]);
});
