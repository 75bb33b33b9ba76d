import { expect, it } from "vitest";
import { readPose, readRevision, withoutRevision, writePose } from "./address.ts";

const POSE = { position: [1, 1.5, -2], yaw: Math.PI / 2, pitch: 0 } as const;

it("the same place of whatever revision there is has no revision in its address, and all else", () => {
  const page = `https://host/?scene=a&rev=x${writePose(POSE, "abc")}`;
  expect(readRevision(new URL(page).hash)).toBe("abc");
  const { hash, search } = new URL(withoutRevision(page));
  expect([readRevision(hash), search]).toEqual([undefined, "?scene=a&rev=x"]);
  expect(hash).toBe(writePose(POSE));
  expect(readPose(hash)?.position).toEqual(POSE.position);
  expect(withoutRevision("https://host/?scene=a")).toBe("https://host/?scene=a");
});
