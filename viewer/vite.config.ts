// How are the page and the element built? Relative URLs, so that the same files work at `/`, in a sub-folder and in a
// bucket. The element has a name without a hash, so that pages elsewhere can refer to it; what both share has one.
import { defineConfig } from "vitest/config";

export default defineConfig({
  base: "./",
  build: {
    outDir: "dist",
    target: "es2022",
    sourcemap: false,
    chunkSizeWarningLimit: 900,
    rollupOptions: {
      input: { index: "index.html", "belvedere-scene": "embed/belvedere-scene.ts" },
      preserveEntrySignatures: "exports-only",
      output: {
        chunkFileNames: "assets/viewer-[hash].js",
        entryFileNames: ({ name }) => (name === "belvedere-scene" ? "embed/[name].js" : "assets/[name]-[hash].js"),
      },
    },
  },
  // People grow out of rules that stand beside the viewer.
  server: { fs: { allow: [".."] } },
  test: {
    // A busy machine fails nothing; what hangs does.
    testTimeout: 120_000,
    include: ["core/**/*.test.ts", "three/**/*.test.ts", "ui/**/*.test.ts", "embed/**/*.test.ts", "test/**/*.test.ts"],
    environment: "node",
  },
});
