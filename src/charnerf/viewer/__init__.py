"""The viewer of meshes in pages: an HTML element, `<charnerf-mesh>`, and its one script, which comes with the package.

three.js draws it, because it measured smallest and can do what is shown (0.63 MB minified, 0.16 MB compressed; model-viewer has
1.07 and 0.29, no wireframe or clay, and decoders that it loads from the net). `source/` holds what the script is built from:
`npm ci && npm run build` there.
"""
