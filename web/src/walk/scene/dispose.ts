/** Release of GPU memory. */

import { type Material, type Object3D, Texture } from 'three'

/** Dispose of geometries, materials and textures of an object and its descendants. */
export function disposeTree(root: Object3D): void {
  root.traverse((object) => {
    const { geometry, material } = object as {
      geometry?: { dispose(): void }
      material?: Material | Material[]
    }
    geometry?.dispose()
    for (const one of material === undefined ? [] : [material].flat()) disposeMaterial(one)
  })
}

function disposeMaterial(material: Material): void {
  for (const value of Object.values(material)) if (value instanceof Texture) value.dispose()
  material.dispose()
}
