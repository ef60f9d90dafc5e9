/** Selections on axes as query values: `FI1R:1500:3000,fitness:10:12`. */

import type { Brushes } from '../../charts/parallel/parallel-coordinates'
import type { Axis, Brush } from '../../charts/parallel/parallel-model'
import { shareOf, valueAt } from '../../charts/scale'

/** Write brushes by value, not by position, so that links stay valid when bounds change. */
export function brushWords(axes: readonly Axis[], brushes: Brushes): string | null {
  const words = [...brushes].map(([index, brush]) => {
    const ends = brush.map((place) => Number(valueAt(axes[index], place).toPrecision(6)))
    return [axes[index].name, ...ends].join(':')
  })
  return words.length === 0 ? null : words.join(',')
}

/** Parse brushes; `unknown` collects those of hidden axes and invalid ones. */
export function brushesOf(
  axes: readonly Axis[],
  text: string | null,
): { readonly brushes: Brushes; readonly unknown: readonly string[] } {
  const brushes = new Map<number, Brush>()
  const unknown: string[] = []
  for (const word of (text ?? '').split(',').filter((part) => part !== '')) {
    const parts = word.split(':')
    const [high, low] = [parts.pop(), parts.pop()].map((part) => Number(part || Number.NaN))
    const index = axes.findIndex(({ name }) => name === parts.join(':'))
    const places = index < 0 ? [Number.NaN] : [low, high].map((v) => shareOf(axes[index], v))
    if (places.some(Number.isNaN) || places[0] > places[1]) unknown.push(word)
    else brushes.set(index, places.map((p) => Math.min(1, Math.max(0, p))) as unknown as Brush)
  }
  return { brushes, unknown }
}
