import { expect, it } from "vitest";
import { readSrc, SrcError } from "./src.ts";

const PAGE = "https://page/blog/";

it("a link may be one from the page on", () => {
  expect(readSrc("https://host/?scene=a#p=1,2,3", PAGE).href).toBe("https://host/?scene=a#p=1,2,3");
  expect(readSrc("../worlds/?scene=a", PAGE).href).toBe("https://page/worlds/?scene=a");
});

it.each(["ftp://x/", "javascript:alert(1)", "http://[", "data:,x"])("what is none is named: %s", (src) => {
  expect(() => readSrc(src, PAGE)).toThrow(`“src=${src}” is not a web address. Give this <belvedere-scene>`);
  expect(() => readSrc(src, PAGE)).toThrow(SrcError);
});

it.each([null, "", " "])("a src of %j is missing, and one is told what to write", (src) => {
  expect(() => readSrc(src, PAGE)).toThrow(/^“src” is missing. .*src="https:/);
});

it("a page without a web address is told so, and what is long is cut", () => {
  expect(() => readSrc("?scene=a", "file:///home/page.html")).toThrow(
    "“src=?scene=a” is not a web address from file:///home/page.html",
  );
  expect(() => readSrc(`data:,${"x".repeat(1000)}`, PAGE)).toThrow(/^“src=data:,x{74}…”/);
});
