/** Choice of the axes of a chart. */

import { Select } from '../components/fields/controls'
import { inWords } from '../format/words'

/** Choice of one axis among names, other than that of the other axis. */
export function AxisSelect({
  label,
  axes,
  x,
  other,
  onSelect,
}: {
  label: string
  axes: readonly { readonly name: string }[]
  x: string
  other: string
  onSelect: (name: string) => void
}) {
  return (
    <Select
      label={label}
      value={x}
      options={axes.map(({ name }) => [name, inWords(name), name === other] as const)}
      onChoose={onSelect}
    />
  )
}
