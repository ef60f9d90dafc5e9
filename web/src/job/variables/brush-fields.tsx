/** Numeric fields for the selection, for keyboards and exact bounds. */

import { type Brushes, withBrush } from '../../charts/parallel/parallel-coordinates'
import type { Axis, ParallelModel } from '../../charts/parallel/parallel-model'
import { shareOf, valueAt } from '../../charts/scale'
import { NumberField, Select } from '../../components/fields/controls'
import { BrokenName, Unit } from '../../components/text'
import { inWords } from '../../format/words'
import './brush-fields.css'

interface BrushFieldsProps {
  model: ParallelModel
  brushes: Brushes
  onBrush: (brushes: Brushes) => void
}

export function BrushFields({ model, brushes, onBrush }: BrushFieldsProps) {
  return (
    <details class="brush-fields">
      <summary>Select by numbers</summary>
      <div class="brush-grid">
        {model.axes.map((axis, index) => {
          const [low, high] = brushes.get(index) ?? [0, 1]
          const change = (end: 'low' | 'high', text: string) => {
            const place = text === '' ? (end === 'low' ? 0 : 1) : shareOf(axis, Number(text))
            if (Number.isNaN(place)) return
            // Bounds in the wrong order are swapped.
            const ends = end === 'low' ? [place, high] : [low, place]
            const brush = [Math.min(...ends), Math.max(...ends)] as const
            const whole = brush[0] <= 0 && brush[1] >= 1
            onBrush(withBrush(brushes, index, whole ? null : brush))
          }
          return (
            <fieldset key={axis.name}>
              <legend>
                <BrokenName name={axis.name} />
                <Unit unit={axis.unit} />
              </legend>
              <Bound axis={axis} name="from" place={low} onChange={(text) => change('low', text)} />
              <Bound axis={axis} name="to" place={high} onChange={(text) => change('high', text)} />
            </fieldset>
          )
        })}
      </div>
    </details>
  )
}

interface BoundProps {
  axis: Axis
  name: 'from' | 'to'
  place: number
  onChange: (text: string) => void
}

function Bound({ axis, name, place, onChange }: BoundProps) {
  const label = `${axis.name} ${name}`
  if (axis.choices.length > 0) {
    return (
      <div class="row small">
        {name}
        <Select
          hidden
          label={label}
          value={String(Math.round(valueAt(axis, place)))}
          options={axis.choices.map((choice, index) => [String(index), inWords(choice)] as const)}
          onChoose={onChange}
        />
      </div>
    )
  }
  return (
    <div class="row small">
      {name}
      <NumberField
        label={label}
        value={Number(valueAt(axis, place).toPrecision(4))}
        narrow
        onChange={onChange}
      />
    </div>
  )
}
