// Does the script for the edge of a CDN (deploy/signed-links.js) agree with the server about links?
import { describe, expect, it } from "vitest";

const script = new URL("../../deploy/signed-links.js", import.meta.url).href;
const { default: links } = await import(/* @vite-ignore */ script);

const key = "0123456789abcdef".repeat(4);
// The same link as in src/links.rs.
const link = "/s/town/1800000000/3eea01a9cd79c319c168bc684055adff0ebc5b0d5d15d486a413d8e0436a2abc";
const opened = (path: string, now = 1_700_000_000) =>
  links.opened(path, (scene: string) => ({ town: key, tower: key })[scene], now);

describe("a link at the edge", () => {
  it("opens its scene until it expires", () => {
    expect(opened(`${link}/o/x.glb`)).toEqual({ scene: "town", expires_s: 1_800_000_000, below: "/o/x.glb" });
    expect(opened(`${link}/`, 1_799_999_999)?.below).toBe("/");
    expect(opened(`${link}/`, 1_800_000_000)).toBe(null);
  });

  it("opens nothing when a sign of it is another", () => {
    for (const wrong of [
      link,
      `${link.replace("town", "tower")}/`,
      `${link.replace("town", "nowhere")}/`,
      `${link.replace("1800000000", "1900000000")}/`,
      `${link.replace("1800000000", "01800000000")}/`,
      `${link.slice(0, -1)}d/`,
      `${link.toUpperCase()}/`,
      `x${link}/`,
      "/",
    ]) {
      expect(opened(wrong), wrong).toBe(null);
    }
  });
});
