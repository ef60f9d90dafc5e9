/** Surface, rules, table and membership functions of one fuzzy output. */

import { useMemo, useState } from 'preact/hooks'
import { LineCard } from '../charts/chart-card'
import { Card } from '../components/card'
import { Table } from '../components/table/table'
import { formatCount, formatExact, formatNumber, percent, quantity } from '../format/number'
import { HeatMap } from './heat-map'
import {
  type Cell,
  firstCell,
  indexOf,
  layersOf,
  type Output,
  ruleText,
  type SurfaceView as Surface,
  strength,
  type Universe,
} from './surface'
import { SurfaceView } from './surface-view'

const COLOURS = ['--series-1', '--series-2', '--series-3', '--series-4', '--series-5'] as const

interface FuzzyPanelProps {
  surface: Surface
  output: Output
}

export function FuzzyPanel({ surface, output }: FuzzyPanelProps) {
  const layers = useMemo(() => layersOf(surface, output), [surface, output])
  const [chosen, setChosen] = useState<Cell | null>(null)
  const cell = chosen ?? firstCell(layers[0])
  return (
    <div class="stack">
      <div class="grid fuzzy-grid">
        <SurfaceView layers={layers} name={output.name} cell={cell} />
        <Rules surface={surface} output={output} cell={cell} />
      </div>
      <LookupTable output={output} />
      <div class="grid maps">
        {layers.map((layer) => (
          <HeatMap key={layer.key} layer={layer} cell={cell} onCell={setChosen} />
        ))}
      </div>
      <div class="grid maps">
        {surface.inputs.map((input) => (
          <MembershipCard
            key={input.name}
            universe={input}
            side="Input"
            marker={input.values[indexOf(input, surface, cell)]}
          />
        ))}
        <MembershipCard
          universe={output}
          side="Output"
          marker={output.inference[cell.error][cell.current]}
        />
      </div>
    </div>
  )
}

function Rules({ surface, output, cell }: FuzzyPanelProps & { cell: Cell }) {
  const rows = output.rules.map((rule, k) => ({
    number: k + 1,
    rule,
    fires: strength(rule, surface, cell),
  }))
  return (
    <Card
      title={`Rules of ${output.name}`}
      note="The strength of a rule is its weakest condition times its weight."
    >
      <Table
        caption={`Rules of ${output.name}`}
        columns={[
          { key: 'rule', numeric: true, header: true, value: ({ number }) => number },
          { key: 'text', cell: ({ rule }) => ruleText(rule, output.name) },
          {
            key: 'weight',
            numeric: true,
            value: ({ rule }) => rule.weight,
            cell: ({ rule }) => formatExact(rule.weight, 4),
          },
          {
            key: 'strength',
            numeric: true,
            value: ({ fires }) => fires,
            cell: ({ fires }) => (
              <span class="firing">
                <i class="firing-bar" aria-hidden="true">
                  <b style={{ width: `${100 * fires}%` }} />
                </i>
                <span>{fires.toFixed(3)}</span>
              </span>
            ),
          },
        ]}
        rows={rows}
      />
    </Card>
  )
}

function LookupTable({ output }: { output: Output }) {
  const { quantisation: q, unit, range } = output
  const inputs = [
    `error ${q.error_bits} bit`,
    `current ${q.current_bits} bit`,
    ...(q.velocity_bits === null ? [] : [`velocity ${q.velocity_bits} bit`]),
  ]
  const figures = [
    ['memory', `${formatCount(q.bytes)}\u00a0bytes`],
    ['index', inputs.join(', ')],
    ['entry', `${q.output_bits}\u00a0bit`],
    [
      'largest difference',
      quantity(q.largest_difference, unit, 3),
      `(${percent(q.largest_difference / range[1], 2)} of the range)`,
    ],
    [
      'rms difference',
      quantity(q.rms_difference, unit, 3),
      `(${percent(q.rms_difference / range[1], 2)})`,
    ],
  ]
  return (
    <Card
      title="Lookup table"
      note="The microcontroller looks up the output in a table instead of computing the inference."
    >
      <dl class="figures">
        {figures.map(([term, value, share]) => (
          <div key={term}>
            <dt>{term}</dt>
            <dd>
              {value} {share && <span class="unit">{share}</span>}
            </dd>
          </div>
        ))}
      </dl>
    </Card>
  )
}

interface MembershipCardProps {
  universe: Universe
  side: 'Input' | 'Output'
  marker: number
}

function MembershipCard({ universe, side, marker }: MembershipCardProps) {
  const { name, unit, values, memberships } = universe
  const series = useMemo(
    () =>
      memberships.map((membership, k) => ({
        label: membership.name,
        values: membership.degrees,
        colour: COLOURS[k % COLOURS.length],
        width: 2,
      })),
    [memberships],
  )
  return (
    <div class="plot">
      <LineCard
        title={`${side}: ${name}`}
        note="Degree of membership; the line marks the selected point."
        caption={`Degrees of membership of ${name}`}
        format={(degree) => formatNumber(degree, 3)}
        zoomName={`zoom-${name}`}
        label={`Fuzzy sets of ${name}: ${memberships.map((m) => m.name).join(', ')}`}
        x={values}
        xLabel={name}
        xUnit={unit}
        yLabel="membership"
        series={series}
        height={170}
        marker={marker}
      />
    </div>
  )
}
