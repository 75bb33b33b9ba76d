import { expect, it } from "vitest";
import { isPoseBroken, readPose, readRevision, treeBase, withoutRevision, writePose } from "./address.ts";

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

it("a link says who flies; who is not said to fly walks, as in links from before that was said", () => {
  const flown = writePose({ ...POSE, mode: "fly" }, "abc");
  expect(flown).toBe("#p=1.000,1.500,-2.000&yaw=90.00&pitch=0.00&mode=fly&rev=abc");
  expect([readPose(flown)?.mode, readRevision(flown)]).toEqual(["fly", "abc"]);
  const walked = writePose({ ...POSE, mode: "walk" });
  expect(walked).toBe(writePose(POSE));
  expect(readPose(walked)?.mode).toBe("walk");
  expect(readPose("#p=1,2,3&mode=swim")?.mode).toBe("walk");
});

it("what is no web address is no base of a tree", () => {
  expect(treeBase("https://host/sub/?base=../other/")).toBe("https://host/other/");
  expect(() => treeBase("https://host/?base=http://%5B")).toThrow("is not a web address");
  expect(() => treeBase("https://host/?base=ftp://x/")).toThrow("is not a web address");
});

it.each(["#p=abc", "#p=1,NaN,2", "#p=1,2", "#p=1,2,3,4", "#p=", "#p=1,2,3&yaw=north"])("%s is no pose", (hash) => {
  expect([readPose(hash), isPoseBroken(hash)]).toEqual([undefined, true]);
});

it.each(["", "#", "#rev=abc", "#p=1,2,3", "#p=1,2,3&yaw=90&mode=fly"])("nothing is wrong with %j", (hash) => {
  expect(isPoseBroken(hash)).toBe(false);
});
