// How does the core become a library? One module for bundlers and Node, with its workers beside it.
import { defineConfig } from "vite";

export default defineConfig({
  base: "./",
  publicDir: false,
  build: {
    outDir: "lib",
    target: "es2022",
    minify: false,
    modulePreload: false,
    rollupOptions: {
      input: { core: "core/index.ts" },
      preserveEntrySignatures: "strict",
      output: { entryFileNames: "[name].js", chunkFileNames: "[name]-[hash].js" },
    },
  },
});
