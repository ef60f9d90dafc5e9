/** Text labels in a scene. */

import {
  CanvasTexture,
  Mesh,
  MeshBasicMaterial,
  PlaneGeometry,
  Sprite,
  SpriteMaterial,
  SRGBColorSpace,
} from 'three'

const PIXELS = 64

export function textTexture(text: string, colour: string): CanvasTexture {
  const canvas = document.createElement('canvas')
  const context = canvas.getContext('2d')!
  const font = `${0.72 * PIXELS}px system-ui, sans-serif`
  context.font = font
  canvas.width = Math.ceil(context.measureText(text).width + 0.3 * PIXELS)
  canvas.height = PIXELS
  context.font = font
  context.textAlign = 'center'
  context.textBaseline = 'middle'
  context.fillStyle = colour
  context.fillText(text, canvas.width / 2, PIXELS / 2)
  const texture = new CanvasTexture(canvas)
  texture.colorSpace = SRGBColorSpace
  texture.anisotropy = 4
  return texture
}

/** Text lying on the ground, readable from negative y. height: [m]. */
export function lyingText(text: string, colour: string, height: number) {
  const map = textTexture(text, colour)
  const material = new MeshBasicMaterial({ map, transparent: true, depthWrite: false })
  return new Mesh(new PlaneGeometry(height * proportion(map), height), material)
}

/** Text facing the camera. height: [m]. */
export function facingText(text: string, colour: string, height: number): Sprite {
  const map = textTexture(text, colour)
  const sprite = new Sprite(new SpriteMaterial({ map, depthTest: false }))
  sprite.scale.set(height * proportion(map), height, 1)
  return sprite
}

export function proportion(texture: CanvasTexture): number {
  return texture.image.width / texture.image.height
}
