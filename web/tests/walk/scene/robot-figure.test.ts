import { expect, test } from 'vitest'
import { parseReplay } from '../../../src/walk/replay/replay'
import { RobotFigure } from '../../../src/walk/scene/robot-figure'
import { encoded, frames, header } from '../replay/replay-bytes'

const figure = new RobotFigure(parseReplay(encoded(header(11), frames(11))))
const [link] = figure.object.children

test('between two frames, a link moves linearly and rotates uniformly', () => {
  figure.show(0.25)
  const half = (Math.PI / 4) * 0.25
  expect(link.position.x).toBeCloseTo(0.25)
  expect(link.position.z).toBeCloseTo(0.15)
  expect(link.quaternion.z).toBeCloseTo(Math.sin(half))
  expect(link.quaternion.w).toBeCloseTo(Math.cos(half))
})

test('poses are clamped before the start and after the end', () => {
  figure.show(-1)
  expect(link.position.x).toBe(0)
  figure.show(5)
  expect(link.position.x).toBeCloseTo(1)
})
