/** Memory use and accuracy of the quantised table. */

import { formatCount, percent, quantity } from '../format/number'
import type { Output } from './surface'

export function QuantisationCard({ output }: { output: Output }) {
  const { quantisation: q, unit, range } = output
  const inputs = [
    `error ${q.error_bits} bit`,
    `current ${q.current_bits} bit`,
    ...(q.velocity_bits === null ? [] : [`velocity ${q.velocity_bits} bit`]),
  ]
  return (
    <section
      class="card"
      data-bytes={q.bytes}
      data-largest-difference={q.largest_difference}
      data-rms-difference={q.rms_difference}
    >
      <header>
        <h2>Lookup table</h2>
        <p class="muted small">
          The microcontroller looks up the output in a table instead of computing the inference.
        </p>
      </header>
      <dl class="figures">
        <div>
          <dt>memory</dt>
          <dd>{formatCount(q.bytes)}&nbsp;bytes</dd>
        </div>
        <div>
          <dt>index</dt>
          <dd>{inputs.join(', ')}</dd>
        </div>
        <div>
          <dt>entry</dt>
          <dd>{q.output_bits}&nbsp;bit</dd>
        </div>
        <div>
          <dt>largest difference</dt>
          <dd>
            {quantity(q.largest_difference, unit, 3)}{' '}
            <span class="unit">({percent(q.largest_difference / range[1], 2)} of the range)</span>
          </dd>
        </div>
        <div>
          <dt>rms difference</dt>
          <dd>
            {quantity(q.rms_difference, unit, 3)}{' '}
            <span class="unit">({percent(q.rms_difference / range[1], 2)})</span>
          </dd>
        </div>
      </dl>
    </section>
  )
}
