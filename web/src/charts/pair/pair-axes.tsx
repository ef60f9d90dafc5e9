/** Ticks and titles of a chart with two axes. */

import type { ComponentChildren } from 'preact'
import { withUnit } from '../../format/number'
import { inWords } from '../../format/words'
import './pair-axes.css'
import type { Axis } from '../parallel/parallel-model'
import { ticksOf } from './pair-model'

export function PairAxes({
  across,
  up,
  children,
}: {
  across: Axis
  up: Axis
  children: ComponentChildren
}) {
  return (
    <div class="pair-axes">
      <span class="pair-title">{titleOf(up)}</span>
      <div class="pair-up" data-ticks={ticksOf(up).length}>
        {ticksOf(up).map(({ place, text }) => (
          <span key={text} style={{ bottom: `${100 * place}%` }}>
            {text}
          </span>
        ))}
      </div>
      {children}
      <div class="pair-across" data-ticks={ticksOf(across).length}>
        {ticksOf(across).map(({ place, text }) => (
          <span key={text} style={{ left: `${100 * place}%` }}>
            {text}
          </span>
        ))}
      </div>
      <span class="pair-title across">{titleOf(across)}</span>
    </div>
  )
}

function titleOf({ name, unit }: Axis): string {
  return withUnit(inWords(name), unit)
}
