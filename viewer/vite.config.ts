// How is the page built? Relative URLs, so that the same files work at `/`, in a sub-folder and in a bucket.
import { defineConfig } from "vitest/config";

export default defineConfig({
  base: "./",
  build: { outDir: "dist", target: "es2022", sourcemap: false, chunkSizeWarningLimit: 900 },
  test: {
    include: ["core/**/*.test.ts", "three/**/*.test.ts", "ui/**/*.test.ts", "test/**/*.test.ts"],
    environment: "node",
  },
});
