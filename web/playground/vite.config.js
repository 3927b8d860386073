import {fileURLToPath} from 'node:url';
import {defineConfig} from 'vite';

const built = fileURLToPath(new URL('../../build-web/playground', import.meta.url));

export default defineConfig({
  root: fileURLToPath(new URL('.', import.meta.url)),
  base: './',  // any folder of any server will do
  publicDir: `${built}/public`,
  // three.js is most of it.
  build: {
    outDir: `${built}/site`,
    emptyOutDir: true,
    target: 'es2022',
    chunkSizeWarningLimit: 1000,
    reportCompressedSize: false,
  },
  logLevel: 'warn',
});
