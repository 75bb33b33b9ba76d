// What would a browser download of a part of the core, and how large is that?
import { brotliCompressSync, gzipSync } from "node:zlib";
import { build } from "vite";

/** Builds a module as a library of its own, prints its size under a name, and gives what it exports. */
export async function bundled(name, module) {
  return import(await bundledUrl(name, module));
}

/** The same, to be imported from elsewhere. */
export async function bundledUrl(name, module) {
  const entry = new URL(module, import.meta.url).pathname;
  const [{ output }] = await build({
    configFile: false,
    logLevel: "silent",
    build: { write: false, target: "es2022", lib: { entry, formats: ["es"] } },
  });
  const code = output.find(({ isEntry }) => isEntry).code;
  const kilobytes = (bytes) => `${(bytes.length / 1000).toFixed(1)} kB`;
  console.log(`${name}: ${kilobytes(gzipSync(code))} gzip, ${kilobytes(brotliCompressSync(code))} brotli`);
  return `data:text/javascript,${encodeURIComponent(code)}`;
}
