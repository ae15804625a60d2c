// Bundles the viewer with what it needs of three.js into one minified file, beside three.js' licence.
import { createHash } from "node:crypto";
import { copyFileSync, readFileSync } from "node:fs";
import { build } from "esbuild";

const source = createHash("sha256").update(readFileSync("mesh_viewer.js")).digest("hex");
const { version } = JSON.parse(readFileSync("node_modules/three/package.json", "utf8"));
await build({
  entryPoints: ["mesh_viewer.js"],
  outfile: "../mesh_viewer.min.js",
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  charset: "ascii", // the script stands in pages of any encoding
  banner: { js: `/* three.js ${version} (MIT, LICENSE-three.txt) and charnerf's mesh_viewer.js, sha256 ${source} */` },
});
copyFileSync("node_modules/three/LICENSE", "../LICENSE-three.txt");
