import { expect, test } from 'vitest'
import { tableWalks } from '../../../src/submission/fit/targets'

const DESIGN = { controller: 'pi', design: { P: 1 } }

test('rows of a scenario are targets of one walk; comments and the heading are left out', () => {
  const text =
    '# measured in May\nscenario;quantity\ndrop;speed;0.05\ndrop;mean current;1;0.2;predict\n'
  const { walks, problem } = tableWalks(text, DESIGN)
  expect(problem).toBeUndefined()
  expect(walks.map(({ walk, controller, targets }) => [walk, controller, targets])).toEqual([
    [
      'drop',
      'pi',
      [
        { quantity: 'speed', value: '0.05', tolerance: '0.1', use: 'fit' },
        { quantity: 'mean_current', value: '1', tolerance: '0.2', use: 'predict' },
      ],
    ],
  ])
})

test('incomplete rows and tables with other designs are reported', () => {
  expect(tableWalks('drop,speed', DESIGN).problem).toContain('“drop,speed” is not')
  expect(tableWalks('drop,speed,1,,maybe', DESIGN).walks).toEqual([])
  const other = tableWalks('walk,controller,design,scenario,quantity,value\n', DESIGN)
  expect(other.problem).toContain('gaitswarm calibrate')
})
