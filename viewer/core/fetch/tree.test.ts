import { describe, expect, it } from "vitest";
import { addressOfScene, anglesOf, readPose, readRevision, treeBase, writePose } from "../movement/address.ts";
import { Tree } from "./tree.ts";
import { promisedHash, verify, webCryptoDigest } from "./verify.ts";

const HELLO = "2cf24dba5fb0a30e26e83b2ac5b9e29e1b161e5c1fa7425e73043362938b9824";

describe("a tree", () => {
  it("resolves what starts with a slash below its own folder", () => {
    for (const base of ["https://host/sub", "https://host/sub/", "https://host/sub/?a=1#b"]) {
      const tree = new Tree(base);
      expect(tree.resolve("/o/ab.glb")).toBe("https://host/sub/o/ab.glb");
      expect(tree.pointer("museum")).toBe("https://host/sub/v1/scenes/museum/index.json");
    }
    expect(new Tree("https://host").sceneList()).toBe("https://host/v1/scenes/index.json");
  });

  it("refuses paths that would leave it", () => {
    const tree = new Tree("https://host/sub/");
    for (const path of ["", "o/ab", "//evil/o", "/o/../../x", "https://evil/", "/o/a?b", "/o/a#b", "/o/%2e%2e/"]) {
      expect(() => tree.resolve(path), path).toThrow(/not a path/);
    }
    for (const scene of ["", "index", "..", "A", "a/b", "-a"]) expect(() => tree.pointer(scene), scene).toThrow();
  });

  it("lies where the page lies unless the address names another", () => {
    expect(treeBase("https://host/sub/index.html?scene=a#p=1,2,3")).toBe("https://host/sub/");
    expect(treeBase("https://host/sub/?base=https://cdn/x/")).toBe("https://cdn/x/");
    expect(() => treeBase("https://host/?base=javascript:alert(1)")).toThrow(/not a web address/);
  });
});

describe("a pose", () => {
  it("travels in the hash of a link", () => {
    const link = writePose({ position: [1.25, -2, 3e4], yaw: 1, pitch: -0.5 }, "f90c");
    expect([readRevision(link), readRevision("#p=1,2,3")]).toEqual(["f90c", undefined]);
    const pose = readPose(link);
    expect(pose?.position).toEqual([1.25, -2, 30000]);
    expect(pose?.yaw).toBeCloseTo(1, 3);
    expect(pose?.pitch).toBeCloseTo(-0.5, 3);
  });

  it("is ignored when it makes no sense", () => {
    for (const hash of [
      "",
      "#",
      "#p=",
      "#p=1,2",
      "#p=1,2,3,4",
      "#p=a,b,c",
      "#p=1,2,3&yaw=x",
      "#p=1,,3",
      "#p=1,2,Infinity",
    ]) {
      expect(readPose(hash), hash).toBeUndefined();
    }
  });

  it("comes from a quaternion that looks along −Z", () => {
    expect(anglesOf([0, 0, 0, 1]).yaw).toBeCloseTo(0);
    expect(anglesOf([0, Math.SQRT1_2, 0, Math.SQRT1_2]).yaw).toBeCloseTo(Math.PI / 2);
    expect(anglesOf([Math.sin(0.1), 0, 0, Math.cos(0.1)]).pitch).toBeCloseTo(0.2);
  });

  it("does not follow into another scene", () => {
    expect(addressOfScene("https://host/?scene=a&base=x#p=1,2,3", "b")).toBe("https://host/?scene=b&base=x");
  });
});

describe("verification", () => {
  const bytes = new TextEncoder().encode("hello").buffer as ArrayBuffer;

  it("compares bytes with the hash in their URL", async () => {
    const digest = webCryptoDigest();
    expect(await verify(`https://host/o/${HELLO}.glb`, bytes, digest)).toBe("verified");
    expect(await verify(`https://host/o/${HELLO.replace("2", "3")}.glb`, bytes, digest)).toBe("mismatch");
  });

  it("says so when there is nothing to compare with", async () => {
    expect(await verify(`https://host/o/${HELLO}.glb`, bytes, undefined)).toBe("unverified");
    expect(await verify("https://host/v1/scenes/index.json", bytes, webCryptoDigest())).toBe("unverified");
    expect(promisedHash("https://host/o/abc.glb")).toBeUndefined();
  });
});
