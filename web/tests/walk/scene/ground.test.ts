import { Box3, Vector3 } from 'three'
import { expect, test } from 'vitest'
import { heightMesh } from '../../../src/walk/scene/ground'

test('uneven ground is a surface through its heights, facing up', () => {
  const { geometry } = heightMesh({
    x: [0, 1, 3],
    y: [-1, 1],
    z: [
      [0, 0],
      [0.5, 0.5],
      [0.5, 0.2],
    ],
  })
  const place = geometry.getAttribute('position')
  const bounds = new Box3().setFromArray(place.array)
  expect(bounds.min).toEqual(new Vector3(0, -1, 0))
  expect(bounds.max).toEqual(new Vector3(3, 1, 0.5))
  expect(geometry.getIndex()!.count).toBe(3 * 4)
  const normal = geometry.getAttribute('normal')
  for (let k = 0; k < normal.count; k++) expect(normal.getZ(k)).toBeGreaterThan(0.8)
})
