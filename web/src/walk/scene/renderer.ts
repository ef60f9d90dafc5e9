/** WebGL renderer, with reduced quality on software rendering, and release of its memory. */

import { type Material, type Object3D, PCFShadowMap, Texture, WebGLRenderer } from 'three'

const SOFTWARE = /swiftshader|llvmpipe|software|basic render/i

/** Throws without WebGL 2. */
export function createRenderer(): WebGLRenderer {
  const plain = isSoftware()
  const renderer = new WebGLRenderer({ antialias: !plain, powerPreference: 'low-power' })
  renderer.shadowMap.enabled = !plain
  renderer.shadowMap.type = PCFShadowMap
  renderer.setPixelRatio(plain ? 1 : Math.min(2, devicePixelRatio))
  return renderer
}

function isSoftware(): boolean {
  const context = document.createElement('canvas').getContext('webgl2')
  if (!context) throw new Error('This browser does not support WebGL 2.')
  const info = context.getExtension('WEBGL_debug_renderer_info')
  const name = info ? context.getParameter(info.UNMASKED_RENDERER_WEBGL) : ''
  context.getExtension('WEBGL_lose_context')?.loseContext()
  return SOFTWARE.test(String(name))
}

/** Dispose of geometries, materials and textures of an object and its descendants. */
export function disposeTree(root: Object3D): void {
  root.traverse((object) => {
    const { geometry, material = [] } = object as {
      geometry?: { dispose(): void }
      material?: Material | Material[]
    }
    geometry?.dispose()
    for (const each of [material].flat()) {
      for (const value of Object.values(each)) if (value instanceof Texture) value.dispose()
      each.dispose()
    }
  })
}

export function disposeScene(scene: Object3D, renderer: WebGLRenderer): void {
  disposeTree(scene)
  renderer.dispose()
  renderer.forceContextLoss()
  renderer.domElement.remove()
}
