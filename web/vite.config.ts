import { loadEnv } from 'vite'
import { defineConfig } from 'vitest/config'

// The API that `npm run dev` shows: GAITSWARM_SERVER, else where `gaitswarm serve` listens.
const { GAITSWARM_SERVER: API = 'http://127.0.0.1:8000' } = loadEnv('', '.', 'GAITSWARM_')

export default defineConfig({
  oxc: { jsx: { runtime: 'automatic', importSource: 'preact' } },
  build: {
    // The API serves what lies there.
    outDir: '../api/page',
    emptyOutDir: true,
    target: 'es2022',
    // Assets as data: URLs would need a laxer content security policy.
    assetsInlineLimit: 0,
    // The 3D chunk is large on purpose, and loaded with the first walk.
    chunkSizeWarningLimit: 900,
  },
  server: {
    host: '127.0.0.1',
    proxy: { '/v1': API, '/docs': API, '/docs-assets': API, '/openapi.json': API },
  },
  test: {
    include: ['tests/**/*.test.ts'],
    // Stylesheets are read by the test of their classes.
    css: true,
    // Files share modules: a process for each of them takes twenty times what its tests take.
    isolate: false,
    pool: 'threads',
    unstubGlobals: true,
  },
})
