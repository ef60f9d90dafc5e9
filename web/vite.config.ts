import { loadEnv } from 'vite'
import { defineConfig } from 'vitest/config'

// API used by `npm run dev`; by default where `gaitswarm serve` listens.
const { GAITSWARM_SERVER: API = 'http://127.0.0.1:8000' } = loadEnv('', '.', 'GAITSWARM_')

export default defineConfig({
  oxc: { jsx: { runtime: 'automatic', importSource: 'preact' } },
  build: {
    // The API serves this folder.
    outDir: '../api/page',
    emptyOutDir: true,
    target: 'es2022',
    // Assets as data: URLs would require a laxer content security policy.
    assetsInlineLimit: 0,
    // The 3D chunk is large, but loaded only with the first walk.
    chunkSizeWarningLimit: 900,
  },
  server: {
    host: '127.0.0.1',
    proxy: { '/v1': API, '/docs': API, '/docs-assets': API, '/openapi.json': API },
  },
  test: {
    include: ['tests/**/*.test.ts'],
    // Stylesheets are read by tests/styles.
    css: true,
    // One process for all files; a process per file would take twenty times as long.
    isolate: false,
    pool: 'threads',
    unstubGlobals: true,
  },
})
