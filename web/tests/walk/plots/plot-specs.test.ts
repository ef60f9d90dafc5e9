import { expect, test } from 'vitest'
import { moments, plotSpecs, seriesOf } from '../../../src/walk/plots/plot-specs'
import { parseReplay, stances } from '../../../src/walk/replay/replay'
import { encoded, frames, header } from '../replay/replay-bytes'

const walk = (count: number, label: string) => ({
  label,
  replay: parseReplay(encoded(header(count), frames(count))),
})

test('charts of channels that were not recorded are omitted', () => {
  const keys = plotSpecs(walk(3, 'A').replay, 0).map(({ quantity }) => quantity)
  expect(keys).toEqual(['slip', 'force', 'normal force'])
})

test('the second walk has dashed curves, without values after its end', () => {
  const walks = [walk(4, 'A'), walk(2, 'B')]
  const [spec] = plotSpecs(walks[0].replay, 0).filter(({ quantity }) => quantity === 'normal force')
  const [first, second] = seriesOf(spec.curves, walks)
  expect(Array.from(moments(walks))).toHaveLength(4)
  expect([first.label, first.dash, first.values]).toEqual(['leg', undefined, [0, 10, 20, 30]])
  expect([second.label, second.values]).toEqual(['leg, B', [0, 10, null, null]])
  expect(second.dash).toBeDefined()
})

test('moments are those of the longer walk', () => {
  expect(moments([walk(2, 'A'), walk(5, 'B')])).toHaveLength(5)
})

test('a stance lasts from the first force to the last', () => {
  const [[from, to], ...others] = stances(walk(5, 'A').replay, 0)
  expect([from, to].map((moment) => Number(moment.toFixed(3)))).toEqual([0.1, 0.4])
  expect(others).toEqual([])
})
