import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
import { expect, it } from "vitest";
import { decoderReady } from "./decoder.ts";

it("who may run the decoder is not stopped", async () => {
  await expect(decoderReady()).resolves.toBeUndefined();
});

it("tells a page that forbids the decoder from a browser that has none", async () => {
  const blocked = { ...MeshoptDecoder, ready: Promise.reject(new WebAssembly.CompileError("blocked by CSP")) };
  await expect(decoderReady(blocked)).rejects.toMatchObject({ name: "NoDecoderError", isForbidden: true });
  const none = { ...MeshoptDecoder, supported: false };
  await expect(decoderReady(none)).rejects.toMatchObject({ name: "NoDecoderError", isForbidden: false });
});
