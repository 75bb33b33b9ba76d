import { readFileSync } from "node:fs";
import { join } from "node:path";
import { describe, expect, it } from "vitest";
import { addressOf, BundleReader, inOrder, offersBundles } from "./bundles.ts";

/** What is asked for, and answers, as the tests in Rust wrote them, and what comes out of them there. */
const GOLDEN = join(import.meta.dirname, "../../../tests/golden/bundle/cases.json");

interface Answer {
  readonly name: string;
  readonly members: number;
  readonly answer_hex: string;
  readonly given: readonly { readonly after_bytes: number; readonly hex: string }[];
  readonly whole: boolean;
}

const golden = JSON.parse(readFileSync(GOLDEN, "utf8")) as {
  readonly offer: string;
  readonly asked: { readonly urls: readonly string[]; readonly path: string };
  readonly answers: readonly Answer[];
};

/** What comes out of an answer, byte after byte; a refusal is the end of it. */
function read({ members, answer_hex }: Answer): Pick<Answer, "given" | "whole"> {
  const reader = new BundleReader(members);
  const given: { after_bytes: number; hex: string }[] = [];
  const bytes = Buffer.from(answer_hex, "hex");
  try {
    for (let at = 0; at < bytes.length; at += 1) {
      for (const member of reader.push(bytes.subarray(at, at + 1)))
        given.push({ after_bytes: at + 1, hex: Buffer.from(member).toString("hex") });
    }
  } catch (error) {
    expect(String(error)).toContain("BundleError");
    return { given, whole: false };
  }
  return { given, whole: reader.isWhole };
}

describe("bundles in TypeScript and in Rust", () => {
  it("are offered and asked for alike", () => {
    expect(offersBundles(new Headers({ Link: golden.offer }))).toBe(true);
    const { urls, path } = golden.asked;
    const wanted = urls.map((url) => ({ url, bytes: 100 }));
    for (let turn = 0; turn < wanted.length; turn += 1) {
      const turned = [...wanted.slice(turn), ...wanted.slice(0, turn)];
      expect(addressOf(inOrder(turned))).toBe(path);
    }
  });

  it.each(golden.answers)("give the same members at the same time: $name", (answer) => {
    const { given, whole } = answer;
    expect(read(answer)).toEqual({ given, whole });
  });
});
