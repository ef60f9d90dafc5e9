/** The renderer, plainer where the machine draws without a graphics card. */

import { PCFShadowMap, WebGLRenderer } from 'three'

/** Names of drivers that compute pictures on the processor. */
const SOFTWARE = /swiftshader|llvmpipe|software|basic render/i

/** Throws where there is no WebGL 2. */
export function createRenderer(): WebGLRenderer {
  const plain = isSoftware()
  const renderer = new WebGLRenderer({ antialias: !plain, powerPreference: 'low-power' })
  renderer.shadowMap.enabled = !plain
  renderer.shadowMap.type = PCFShadowMap
  renderer.setPixelRatio(plain ? 1 : Math.min(2, devicePixelRatio))
  return renderer
}

/** Asked of a context of its own, which is given back at once. */
function isSoftware(): boolean {
  const context = document.createElement('canvas').getContext('webgl2')
  if (!context) throw new Error('This browser gives no WebGL 2.')
  const info = context.getExtension('WEBGL_debug_renderer_info')
  const name = info ? context.getParameter(info.UNMASKED_RENDERER_WEBGL) : ''
  context.getExtension('WEBGL_lose_context')?.loseContext()
  return SOFTWARE.test(String(name))
}
